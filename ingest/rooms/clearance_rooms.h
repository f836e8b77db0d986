// SPDX-License-Identifier: Apache-2.0
// Rooms from free space alone, without a ceiling.
// Refuses labels and ceilings; heights matter only in that furniture is lower than walls.
#pragma once

#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/plan_regions.h"

namespace dsg::ingest {

/// Divides a plan at the narrow ways through its walls. Every free cell gets a region that can be
/// reached from one.
DividedPlan ClearanceRegions(const OccupancyGrid& plan, const RoomOptions& options);

}  // namespace dsg::ingest
