// SPDX-License-Identifier: Apache-2.0
#include "query/engine/node_mesh.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/engine/request.h"
#include "schema/model/known_names.h"
#include "schema/model/mesh_part.h"

namespace dsg::query {
namespace {

/// Around the box of an object: its faces are as thick as a voxel.
constexpr double kObjectMarginM = 0.05;
/// Around a room, and how far a triangle may lie off a structure.
constexpr double kShellMarginM = 0.1;

// Of the corners of a face what they agree on, else 0.
uint32_t Agreed(const std::vector<uint32_t>& channel, const std::array<uint32_t, 3>& face) {
  if (channel.empty()) return 0;
  const uint32_t value = channel[face[0]];
  return value == channel[face[1]] && value == channel[face[2]] ? value : 0;
}

Box3d Grown(Box3d box, double margin_m) {
  box.min().array() -= margin_m;
  box.max().array() += margin_m;
  return box;
}

Box3d RegionBounds(const Node& node) {
  if (!node.region.has_value() || node.region->footprint_map.empty()) return node.BoxMap();
  const RegionInfo& region = *node.region;
  // A region that does not tell its heights has those of its box.
  const bool has_heights = region.z_max_m > region.z_min_m || node.box_node.isEmpty();
  const double low_m = has_heights ? region.z_min_m : node.BoxMap().min().z();
  const double high_m = has_heights ? region.z_max_m : node.BoxMap().max().z();
  Box3d box;
  for (const Eigen::Vector2d& corner : region.footprint_map) {
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), low_m));
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), high_m));
  }
  return box;
}

bool HasExtent(const Node& node) {
  return !node.box_node.isEmpty() ||
         (node.region.has_value() && !node.region->footprint_map.empty());
}

}  // namespace

absl::StatusOr<NodeMesh> NodeMesh::Of(const Node& node) {
  if (node.agent.has_value() || node.layer == layers::kAgents) {
    return FieldError("node", ToString(node.id),
                      "agents have bodies over time and no part of the mesh: ask GetAgentShape");
  }
  if (node.place.has_value() || node.layer == layers::kPlaces) {
    return FieldError("node", ToString(node.id),
                      "places are free space: ask for the mesh of their room");
  }
  NodeMesh mesh(node);
  if (mesh.instance_id_ != 0 || HasExtent(node)) return mesh;
  return FieldError("node", ToString(node.id),
                    "it has no box, no footprint and no instance id, which would tell its "
                    "triangles: ask with a box");
}

NodeMesh::NodeMesh(const Node& node) : node_(node) {
  if (node.object.has_value()) instance_id_ = node.object->mesh_instance_id;
  if (node.structure.has_value()) instance_id_ = node.structure->mesh_instance_id;
  if (instance_id_ != 0 && node.box_node.isEmpty()) {
    const double far = std::numeric_limits<double>::max();
    bounds_map_ = Box3d(Eigen::Vector3d::Constant(-far), Eigen::Vector3d::Constant(far));
  } else if (instance_id_ == 0 && node.structure.has_value()) {
    structure_ = FactsOf(node);
    bounds_map_ = Grown(structure_->box_map, kShellMarginM);
  } else if (instance_id_ != 0 || node.object.has_value()) {
    bounds_map_ = Grown(node.BoxMap(), kObjectMarginM);
  } else {
    bounds_map_ = Grown(RegionBounds(node), kShellMarginM);
  }
}

bool NodeMesh::IsOfNode(const MeshBlock& block, const std::array<uint32_t, 3>& face) const {
  if (instance_id_ != 0) {
    // Two nodes may be pieces of what was one thing, and have its instance id both.
    return Agreed(block.instance_ids, face) == instance_id_ &&
           (node_.box_node.isEmpty() || node_.DistanceTo(CenterOf(block, face)) <= kObjectMarginM);
  }
  const uint32_t label = Agreed(block.labels, face);
  if (structure_.has_value()) {
    const auto corner = [&](int i) {
      return block.positions_map[face[static_cast<size_t>(i)]].cast<double>();
    };
    return LiesOn(*structure_, MakeTriangle(corner(0), corner(1), corner(2)), label);
  }
  const Eigen::Vector3d middle = CenterOf(block, face);
  if (!bounds_map_.contains(middle)) return false;
  if (node_.object.has_value()) {
    const bool is_other = label > 0 && node_.class_id > 0 && int64_t{label} != node_.class_id;
    return !is_other && node_.DistanceTo(middle) <= kObjectMarginM;
  }
  if (!node_.region.has_value() || node_.region->footprint_map.empty()) {
    return node_.DistanceTo(middle) <= kShellMarginM;
  }
  return SignedDistanceToPolygon(node_.region->footprint_map, middle.head<2>()) <= kShellMarginM;
}

MeshBlock NodeMesh::Cut(const MeshBlock& block) const {
  std::vector<std::array<uint32_t, 3>> faces;
  std::vector<bool> is_kept(block.positions_map.size(), false);
  for (const std::array<uint32_t, 3>& face : UsableFaces(block)) {
    if (!IsOfNode(block, face)) continue;
    for (const uint32_t corner : face) is_kept[corner] = true;
    faces.push_back(face);
  }
  return PartOf(block, is_kept, std::move(faces));
}

}  // namespace dsg::query
