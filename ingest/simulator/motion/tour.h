// SPDX-License-Identifier: Apache-2.0
// In which order a robot stops where, so that it sees all rooms of a world.
// Refuses to know how it gets from stop to stop.
#pragma once

#include <cstddef>
#include <vector>

#include "ingest/simulator/world/world.h"
#include "schema/base/random.h"

namespace dsg::simulator {

struct TourOptions {
  /// Metres of detour for a metre nearer to the middle of a room: 0 stops behind the door.
  double center_pull = 2.0;
  /// Room whose door the tour starts near, so that it is seen first; -1 = any.
  int first_room = -1;
};

/// Visits each area of each room once, the nearest first, comes back to the first stop, does the
/// same in reverse, and so on without end. Large rooms have several areas.
class Tour {
 public:
  /// Starts in a corridor or hallway near a door. Requires: a world with places.
  Tour(const World& world, const TourOptions& options, Random* random);

  /// Place of a stop; 0 is the start.
  int StopAt(size_t index) const;
  /// How many stops see everything once, the start included.
  size_t round_count() const { return places_.size(); }

 private:
  std::vector<int> places_;
};

}  // namespace dsg::simulator
