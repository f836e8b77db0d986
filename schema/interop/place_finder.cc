// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/place_finder.h"

#include <algorithm>

namespace dsg {
namespace {

constexpr double kReachM = 4.0;

}  // namespace

PlaceFinder::PlaceFinder(const std::vector<Node>& nodes) {
  for (const Node& node : nodes) {
    if (node.kind == kinds::kPlace) places_.emplace_back(node.map_T_node.position, node.id);
  }
  std::sort(places_.begin(), places_.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first.x(), a.second) < std::pair(b.first.x(), b.second);
  });
}

NodeId PlaceFinder::Nearest(const Eigen::Vector3d& point_map) const {
  NodeId best;
  double best_m = kReachM;
  const auto begin =
      std::lower_bound(places_.begin(), places_.end(), point_map.x() - kReachM,
                       [](const auto& place, double x) { return place.first.x() < x; });
  for (auto it = begin; it != places_.end() && it->first.x() <= point_map.x() + best_m; ++it) {
    const double distance_m = (it->first - point_map).norm();
    if (distance_m < best_m || (distance_m == best_m && it->second < best)) {
      best = it->second;
      best_m = distance_m;
    }
  }
  return best;
}

}  // namespace dsg
