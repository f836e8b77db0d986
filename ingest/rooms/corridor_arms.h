// SPDX-License-Identifier: Apache-2.0
// Cuts a net of corridors at its crossings and corners, so that each straight piece is a room.
// Refuses to cut what is not long and narrow.
#pragma once

#include "ingest/rooms/plan_regions.h"
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {

/// Regions that consist of straight arms of one width, each much longer than wide, become one
/// region an arm; the squares where they meet are shared out. Order: other regions keep their
/// numbers, the arms of a net take its number and new ones.
void SplitCorridors(const CorridorOptions& options, PlanRegions* regions);

}  // namespace dsg::ingest
