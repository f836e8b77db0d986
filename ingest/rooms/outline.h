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

/// Angle to the nearest axis, within 45 degrees, that the edges of outlines have, longer ones
/// counting for more. Corners nearer than `tolerance_m` to a line between others do not count, so
/// that steps of cells are no edges.
double MainAngle(const std::vector<Polygon2d>& outlines, double tolerance_m);

}  // namespace dsg::ingest
