// SPDX-License-Identifier: Apache-2.0
// Free-space places about a metre apart, one in every doorway, and the straight walks between
// them. Refuses places and walks that come closer to an obstacle than a body needs.
#pragma once

#include <vector>

#include "ingest/simulator/world/floor_plan.h"
#include "ingest/simulator/world/free_space.h"

namespace dsg::simulator {

/// Straight walks keep this far from all obstacles.
inline constexpr double kWalkClearanceM = 0.3;

/// On the floor, z = 0.
struct Place {
  Point position = Point::Zero();
  int room = 0;
  /// Index in FloorPlan::doors; -1 inside a room.
  int door = -1;
  /// Distance to the nearest wall or furniture, metres.
  double clearance_m = 0.0;
};

/// Walkable both ways; from < to.
struct PlaceEdge {
  int from = 0;
  int to = 0;
  /// Of the whole segment, metres.
  double clearance_m = 0.0;
};

struct PlaceGraph {
  std::vector<Place> places;
  std::vector<PlaceEdge> edges;

  /// Neighbours of each place, ascending.
  std::vector<std::vector<int>> Neighbours() const;
};

/// The places that can be reached from the first door. Order: by room, then row by row; doorways
/// after their room's.
PlaceGraph BuildPlaceGraph(const FloorPlan& plan, const FreeSpace& free_space);

/// All doors of the room can be reached from each other through it, and so can most of its floor.
bool IsRoomWalkable(const FloorPlan& plan, int room, const FreeSpace& free_space);

}  // namespace dsg::simulator
