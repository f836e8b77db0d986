// SPDX-License-Identifier: Apache-2.0
// Which places and links of a walk graph are near a position.
// Refuses to measure: it gives candidates, whoever asks looks at each.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "query/prediction/cell_map.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

struct WalkGraph;

/// Distances are horizontal.
///
/// Threads: not changed after construction.
class WalkIndex {
 public:
  /// Errors: what `stop` returned.
  static absl::StatusOr<WalkIndex> Make(const WalkGraph& graph, const StopCheck& stop);

  /// All places no further than that, and some that are. Order: ascending.
  std::vector<int> PlacesNear(const Eigen::Vector3d& position_map, double reach_m) const;
  /// The same of links, by the nearest point of each.
  std::vector<int> LinksNear(const Eigen::Vector3d& position_map, double reach_m) const;
  /// Of all places.
  double clearance_m_max() const { return clearance_m_max_; }

  size_t memory_bytes() const { return places_.memory_bytes() + links_.memory_bytes(); }

 private:
  WalkIndex();

  CellMap places_;
  // By their middles.
  CellMap links_;
  double clearance_m_max_ = 0.0;
  double half_link_m_max_ = 0.0;
};

}  // namespace dsg::query
