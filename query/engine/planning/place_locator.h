// SPDX-License-Identifier: Apache-2.0
// Which places are near: cubic cells over the places of a graph.
// Refuses to sort by distance; who asks knows what nearest means.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Threads: immutable.
class PlaceLocator {
 public:
  /// Errors: what `stop` returned.
  static absl::StatusOr<PlaceLocator> Build(const PlaceGraph& graph, const StopCheck& stop);

  /// All places no further than `reach_m` from the box, and some that are. In no useful order.
  void ForEachNear(const Box3d& box_map, double reach_m,
                   const std::function<void(PlaceIndex)>& visit) const;

  /// Of all places, and the longest of all links; metres.
  double clearance_m_max() const { return clearance_m_max_; }
  double link_length_m_max() const { return link_length_m_max_; }

  size_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    uint64_t cell = 0;
    PlaceIndex place = 0;
  };

  PlaceLocator() = default;

  // Ascending cell, then place.
  std::vector<Entry> entries_;
  double clearance_m_max_ = 0.0;
  double link_length_m_max_ = 0.0;
};

}  // namespace dsg::query
