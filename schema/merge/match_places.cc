// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "schema/merge/match_nodes.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

double ClearanceOf(const Node& node) {
  return node.place.has_value() ? node.place->clearance_m : 0.0;
}

// Half of the narrower clearance keeps the straight line between both free of obstacles.
double RadiusOf(const Node& a, const Node& b, const MatchOptions& options) {
  const double half = 0.5 * std::min(ClearanceOf(a), ClearanceOf(b));
  return std::clamp(half, options.place_radius_min_m, options.place_radius_max_m);
}

bool AreCoplanar(const Node& a, const Node& b, const MatchOptions& options) {
  const Eigen::Vector3d& normal = a.structure->plane_normal_map;
  if (normal.isZero() || b.structure->plane_normal_map.isZero()) return false;
  // Signed: the two faces of a wall are two structures.
  if (normal.dot(b.structure->plane_normal_map) < std::cos(options.plane_angle_max_rad)) {
    return false;
  }
  const Eigen::Vector3d middle = b.map_T_node * b.box_node.center();
  return std::abs(normal.dot(middle) + a.structure->plane_offset_m) < options.plane_distance_max_m;
}

// Of the smaller box's largest side, in the frame of a.
double SharedExtent(const Node& a, const Node& b) {
  Box3d box_b = TransformBox(a.map_T_node.Inverse() * b.map_T_node, b.box_node);
  Box3d box_a = a.box_node;
  for (Box3d* box : {&box_a, &box_b}) {
    *box = Box3d(box->min().array() - 0.1, box->max().array() + 0.1);
  }
  const Box3d shared = box_a.intersection(box_b);
  if (shared.isEmpty()) return 0.0;
  return shared.volume() / std::min(box_a.volume(), box_b.volume());
}

bool IsFlat(const Node& node) { return node.structure.has_value() && !node.box_node.isEmpty(); }

}  // namespace

void MatchPlaces(const MapContent& into, const MapContent& other, const MatchOptions& options,
                 std::vector<int>* pair_of) {
  const std::vector<int> mine = into.OfClass(NodeClass::kPlace);
  std::vector<Eigen::Vector3d> positions;
  for (const int i : mine) {
    positions.push_back(into.nodes[static_cast<size_t>(i)].map_T_node.position);
  }
  const PointGrid grid(positions, 1.0);
  for (const int i : other.OfClass(NodeClass::kPlace)) {
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    if (pair >= 0) continue;
    const Node& node = other.nodes[static_cast<size_t>(i)];
    double best = 2.0;
    grid.ForEachNear(node.map_T_node.position, options.place_radius_max_m, [&](int k) {
      const int candidate = mine[static_cast<size_t>(k)];
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      if (known.layer != node.layer) return;
      const double distance = (positions[static_cast<size_t>(k)] - node.map_T_node.position).norm();
      const double relative = distance / RadiusOf(known, node, options);
      if (relative > 1.0 || relative > best || (relative == best && candidate > pair)) return;
      best = relative;
      pair = candidate;
    });
  }
}

void MatchStructures(const MapContent& into, const MapContent& other, const MatchOptions& options,
                     std::vector<int>* pair_of) {
  const std::vector<int> mine = into.OfClass(NodeClass::kStructure);
  for (const int i : other.OfClass(NodeClass::kStructure)) {
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    const Node& node = other.nodes[static_cast<size_t>(i)];
    if (pair >= 0 || !IsFlat(node)) continue;
    const Box3d box = node.BoxMap();
    double best = 0.3;
    for (const int candidate : mine) {
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      if (!IsFlat(known) || known.structure->structure_type != node.structure->structure_type) {
        continue;
      }
      if (known.BoxMap().exteriorDistance(box) > options.plane_distance_max_m) continue;
      if (!AreCoplanar(known, node, options)) continue;
      const double shared = SharedExtent(known, node);
      if (shared <= best) continue;
      best = shared;
      pair = candidate;
    }
  }
}

}  // namespace dsg::merge
