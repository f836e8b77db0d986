// SPDX-License-Identifier: Apache-2.0
// Rooms that stand open to a corridor, without a door or a wall before them.
// Refuses to divide what is compact: an L-shaped room is one room.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/grid/occupancy_grid.h"
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {

/// Closes the openings of bays in a plan of one cell's height whose doors are closed. A bay is a
/// compact part of a region that is not compact itself, as a corridor with all that is open to it
/// is not; its opening is a line from the end of a wall, or a corner of walls, straight to the
/// nearest wall. In a large region that is compact, as a hall divided by thin walls is, openings
/// begin at ends of walls only.
///
/// Order: by the openings' lengths, shortest first.
/// Cost: corners of walls x rays, and for each opening twice the area of its smaller side.
/// Source: ours; for dividing by lines between corners see Mielle et al., "MAORIS", ICRA 2018.
void CloseOpenRooms(const OpenRoomOptions& options, OccupancyGrid* plan);

}  // namespace dsg::ingest
