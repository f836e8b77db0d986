// SPDX-License-Identifier: Apache-2.0
// Outlines of regions of a plan, as simple polygons.
// Refuses holes: pillars and furniture are inside.
#pragma once

#include <vector>

#include "ingest/rooms/plan_regions.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Of the largest connected part of each region; counter-clockwise, without crossings, corners at
/// most a cell from the cells' edges. Empty for a region without cells.
std::vector<Polygon2d> OutlinesOf(const PlanRegions& regions);

/// Positive when counter-clockwise.
double SignedAreaM2(const Polygon2d& polygon);

}  // namespace dsg::ingest
