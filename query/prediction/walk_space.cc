// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/walk_space.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/base/status.h"

namespace dsg::query {

int32_t CellMap::CellOf(double coordinate_m) const {
  // Nobody maps beyond; the cast would be undefined.
  return static_cast<int32_t>(std::clamp(std::floor(coordinate_m / size_m_), -2e9, 2e9));
}

namespace {

constexpr double kIndexCellM = 2.0;
/// Places or links between two questions to the stop check.
constexpr int64_t kIndexPlacesPerStop = 1024;

std::vector<int> Near(const CellMap& cells, const Eigen::Vector3d& position_map, double reach_m) {
  std::vector<int> near;
  cells.ForEachAround(position_map, reach_m, [&](int item) { near.push_back(item); });
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace

WalkIndex::WalkIndex() : places_(kIndexCellM), links_(kIndexCellM) {}

absl::StatusOr<WalkIndex> WalkIndex::Make(const WalkGraph& graph, const StopCheck& stop) {
  WalkIndex index;
  StopCounter counter(stop, kIndexPlacesPerStop);
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    index.places_.Add(graph.places_map[i], 0.0, static_cast<int>(i));
    index.clearance_m_max_ = std::max(index.clearance_m_max_, graph.clearance_m[i]);
  }
  for (size_t i = 0; i < graph.links.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const Eigen::Vector3d& a_map = graph.places_map[graph.links[i].first];
    const Eigen::Vector3d& b_map = graph.places_map[graph.links[i].second];
    index.links_.Add(0.5 * (a_map + b_map), 0.0, static_cast<int>(i));
    index.half_link_m_max_ =
        std::max(index.half_link_m_max_, 0.5 * (a_map - b_map).head<2>().norm());
  }
  return index;
}

std::vector<int> WalkIndex::PlacesNear(const Eigen::Vector3d& position_map, double reach_m) const {
  return Near(places_, position_map, reach_m);
}

std::vector<int> WalkIndex::LinksNear(const Eigen::Vector3d& position_map, double reach_m) const {
  return Near(links_, position_map, reach_m + half_link_m_max_);
}

namespace {

// Of a line that is checked.
constexpr double kLineStepM = 0.1;
constexpr double kFreeCellM = 1.0;
/// Larger clearances are used up to here, so that a place in a hall does not fill a thousand cells.
constexpr double kRadiusMMax = 3.0;
/// Places between two questions to the stop check.
constexpr int64_t kFreePlacesPerStop = 256;

}  // namespace

FreeSpace::FreeSpace() : cells_(kFreeCellM) {}

absl::StatusOr<FreeSpace> FreeSpace::Make(const WalkGraph& graph, const StopCheck& stop) {
  FreeSpace space;
  StopCounter counter(stop, kFreePlacesPerStop);
  space.balls_.reserve(graph.places_map.size());
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    space.balls_.push_back({graph.places_map[i], std::min(graph.clearance_m[i], kRadiusMMax)});
  }
  std::sort(space.balls_.begin(), space.balls_.end(),
            [](const auto& a, const auto& b) { return a.radius_m > b.radius_m; });
  for (size_t i = 0; i < space.balls_.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    space.cells_.Add(space.balls_[i].centre_map, space.balls_[i].radius_m, static_cast<int>(i));
  }
  return space;
}

double FreeSpace::RadiusM(const Eigen::Vector3d& point_map) const {
  double best_m = -std::numeric_limits<double>::infinity();
  for (const int i : cells_.At(point_map)) {
    const Ball& ball = balls_[i];
    // Those that follow are no larger.
    if (ball.radius_m <= best_m) break;
    if (std::abs(ball.centre_map.z() - point_map.z()) > kStoreyHeightM) continue;
    best_m = std::max(best_m, ball.radius_m - (ball.centre_map - point_map).head<2>().norm());
  }
  return best_m;
}

bool FreeSpace::IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                        double margin_m) const {
  const Eigen::Vector3d way = to_map - from_map;
  const double length_m = way.head<2>().norm();
  double along_m = 0.0;
  while (true) {
    const double share = length_m > 0.0 ? std::min(1.0, along_m / length_m) : 1.0;
    const double radius_m = RadiusM(from_map + share * way);
    if (radius_m < margin_m) return false;
    if (share >= 1.0) return true;
    // All within the radius is free, and with the margin all within what is left of it.
    along_m += std::max(kLineStepM, radius_m - margin_m);
  }
}

}  // namespace dsg::query
