// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/mesh_owners.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;

// Twice the voxel size that maps are usually made with.
constexpr double kOnPlaneM = 0.1;
// Legs and skirting boards stand on a floor, but do not face it.
constexpr double kFacingCos = 0.82;
// A box whose side is this close to the plane is tight along it.
constexpr double kAlignedCos = 0.996;
constexpr char kFloor[] = "floor";

struct Plane {
  Vector3d normal;
  double offset_m;
};

Plane ThinnestSide(const Convex& box) {
  int axis = 0;
  box.half.minCoeff(&axis);
  const Vector3d normal = box.axes.col(axis);
  return {normal, -normal.dot(box.center)};
}

bool IsAlong(const Convex& box, const Vector3d& normal) {
  return (box.axes.transpose() * normal).cwiseAbs().maxCoeff() > kAlignedCos;
}

// The polygon that a plane cuts out of a box, as triangles around its first corner.
std::vector<Convex> Cut(const Convex& box, const Plane& plane) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((i & bit) != 0) continue;
      const Vector3d& from = box.corners[i];
      const Vector3d& to = box.corners[i | bit];
      const double before = plane.normal.dot(from) + plane.offset_m;
      const double after = plane.normal.dot(to) + plane.offset_m;
      if ((before > 0.0) == (after > 0.0)) continue;
      corners.push_back(from + before / (before - after) * (to - from));
    }
  }
  if (corners.size() < 3) return {};
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& corner : corners) middle += corner / static_cast<double>(corners.size());
  const Vector3d u = plane.normal.unitOrthogonal();
  const Vector3d v = plane.normal.cross(u);
  std::sort(corners.begin(), corners.end(), [&](const Vector3d& a, const Vector3d& b) {
    return std::atan2(v.dot(a - middle), u.dot(a - middle)) <
           std::atan2(v.dot(b - middle), u.dot(b - middle));
  });
  std::vector<Convex> triangles;
  for (size_t i = 2; i < corners.size(); ++i) {
    triangles.push_back(MakeTriangle(corners[0], corners[i - 1], corners[i]));
  }
  return triangles;
}

}  // namespace

StructureFacts FactsOf(const Node& structure) {
  StructureFacts facts;
  facts.id = structure.id;
  facts.valid = structure.valid;
  facts.class_id = structure.class_id;
  facts.is_floor = structure.class_name == kFloor;
  facts.box_map = structure.BoxMap();
  Plane plane{Vector3d::Zero(), 0.0};
  if (structure.structure.has_value()) {
    facts.is_floor |= structure.structure->structure_type == kFloor;
    facts.instance_id = structure.structure->mesh_instance_id;
    plane = {structure.structure->plane_normal_map, structure.structure->plane_offset_m};
  }
  if (structure.box_node.isEmpty()) {
    facts.shapes = {MakePoint(structure.map_T_node.position)};
    facts.offset_m = -structure.map_T_node.position.z();
    return facts;
  }
  const Convex box = MakeBox(structure.map_T_node, structure.box_node);
  const double length = plane.normal.norm();
  if (length > 0.0 && std::isfinite(length) && std::isfinite(plane.offset_m)) {
    plane = {plane.normal / length, plane.offset_m / length};
    if (!IsAlong(box, plane.normal)) facts.shapes = Cut(box, plane);
  } else {
    plane = ThinnestSide(box);
  }
  if (facts.shapes.empty()) facts.shapes = {box};
  facts.normal_map = plane.normal;
  facts.offset_m = plane.offset_m;
  return facts;
}

bool LiesOn(const StructureFacts& structure, const Convex& triangle, uint32_t label) {
  if (label > 0 && structure.class_id > 0 && static_cast<int64_t>(label) != structure.class_id) {
    return false;
  }
  if (DistanceBetween(structure.box_map, triangle.bounds) > kOnPlaneM) return false;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& corner = triangle.corners[i];
    if (std::abs(structure.normal_map.dot(corner) + structure.offset_m) > kOnPlaneM) return false;
    if (structure.box_map.exteriorDistance(corner) > kOnPlaneM) return false;
  }
  const Vector3d normal =
      (triangle.corners[1] - triangle.corners[0]).cross(triangle.corners[2] - triangle.corners[0]);
  return std::abs(normal.dot(structure.normal_map)) >= kFacingCos * normal.norm();
}

absl::StatusOr<std::shared_ptr<const StructureTable>> ReadStructures(const Snapshot& snapshot,
                                                                     const StopCheck& stop) {
  auto table = std::make_shared<StructureTable>();
  NodeFilter filter;
  filter.layer = layers::kStructures;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    table->emplace(node.id, FactsOf(node));
    return true;
  }));
  return table;
}

absl::StatusOr<std::shared_ptr<const OwnerTable>> ReadOwners(const Snapshot& snapshot,
                                                             const StopCheck& stop) {
  auto table = std::make_shared<OwnerTable>();
  for (const LayerId layer : {layers::kObjects, layers::kStructures}) {
    NodeFilter filter;
    filter.layer = layer;
    DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
      const bool is_object = node.object.has_value();
      uint32_t instance = 0;
      if (is_object) instance = node.object->mesh_instance_id;
      if (node.structure.has_value()) instance = node.structure->mesh_instance_id;
      if (instance == 0) return true;
      table->by_instance.try_emplace(instance, MeshOwner{node.id, is_object, node.valid});
      table->instance_of.emplace(node.id, instance);
      return true;
    }));
  }
  return table;
}

}  // namespace dsg::query
