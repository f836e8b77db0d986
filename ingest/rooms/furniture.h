// SPDX-License-Identifier: Apache-2.0
// What stands in rooms and is no wall, in a plan of one cell's height.
// Refuses labels: the shape of what is not free decides.
#pragma once

#include "ingest/grid/occupancy_grid.h"
#include "ingest/rooms/plan_regions.h"
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {

/// Makes free what stands alone and is no piece of a wall: legs of tables and chairs, bins, and
/// blocks as thick as furniture and pillars are. What was never seen inside or behind such a thing
/// is a part of it; nothing that reaches the rim of the plan is one.
///
/// Cost: linear in the cells.
void FreeIslands(const FurnitureOptions& options, OccupancyGrid* plan);

/// Gives rooms the floor under what stands along their walls: cells of no region in a corner or
/// niche of a room that is as deep and long as furniture, and ends where the room's walls go on.
/// Walls that part rooms, and corners of shafts and other rooms, stay without a region.
///
/// Order: a cell that two rooms might have is the nearer one's.
/// Cost: cells along walls x rays of FurnitureOptions::long_m.
void CoverFurniture(const FurnitureOptions& options, PlanRegions* regions);

}  // namespace dsg::ingest
