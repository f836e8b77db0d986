// SPDX-License-Identifier: Apache-2.0
// Which places and links a robot may use: wide enough, there at the time, not blocked.
// Refuses to know where it starts and where it goes.
#pragma once

#include <cstdint>
#include <vector>

#include "query/view/place_graph.h"

namespace dsg::query {

/// The instant at which exactly what has no known end is there.
inline constexpr TimeNs kPresent = kTimeMax - 1;

struct Limits {
  /// At least 0, finite.
  double radius_m = 0.0;
  TimeNs at_ns = kPresent;
  /// All that ever was; at_ns then means nothing.
  bool any_time = false;
  /// One entry a place, or none at all: not 0 = the place may not be used.
  std::vector<uint8_t> blocked;

  bool Admits(const PlaceGraph& graph, PlaceIndex place) const {
    return graph.clearance_m(place) >= radius_m && Holds(graph.valid(place)) &&
           (blocked.empty() || blocked[static_cast<size_t>(place)] == 0);
  }
  /// Of the link alone; whether the places at its ends may be used is another question.
  bool Admits(const PlaceGraph::Link& link) const {
    return link.clearance_m >= static_cast<float>(radius_m) && Holds(link.valid);
  }
  bool Holds(const Interval& valid) const { return any_time || valid.Contains(at_ns); }
};

}  // namespace dsg::query
