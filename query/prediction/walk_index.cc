// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/walk_index.h"

#include <algorithm>

#include "query/prediction/prediction.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kCellM = 2.0;
/// Places or links between two questions to the stop check.
constexpr int64_t kStopPeriod = 1024;

std::vector<int> Near(const CellMap& cells, const Eigen::Vector3d& position_map, double reach_m) {
  std::vector<int> near;
  cells.ForEachAround(position_map, reach_m, [&](int item) { near.push_back(item); });
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace

WalkIndex::WalkIndex() : places_(kCellM), links_(kCellM) {}

absl::StatusOr<WalkIndex> WalkIndex::Make(const WalkGraph& graph, const StopCheck& stop) {
  WalkIndex index;
  StopCounter counter(stop, kStopPeriod);
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

}  // namespace dsg::query
