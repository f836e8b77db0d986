// SPDX-License-Identifier: Apache-2.0
// Who was in which room when, exactly, from the noise-free walks.
// Refuses to sample: a doorway is crossed at the instant the path crosses the wall's middle.
#pragma once

#include <vector>

#include "ingest/simulator/world/walker.h"

namespace dsg::simulator {

/// [enter_ns, exit_ns) in the cell of a room.
struct RoomVisit {
  int room = 0;
  TimeNs enter_ns = 0;
  TimeNs exit_ns = 0;
  bool operator==(const RoomVisit&) const = default;
};

/// The agent's visits from 0 to `until_ns`, without gaps or overlaps, neighbours in different
/// rooms. Runs `walker`, which must be fresh, to the end.
std::vector<RoomVisit> RoomVisits(const FloorPlan& plan, TimeNs until_ns, Walker* walker);

}  // namespace dsg::simulator
