// SPDX-License-Identifier: Apache-2.0
// How far free space reaches around a cell, as a box.
// Refuses boxes with a cell in them that is occupied or was never seen.
#pragma once

#include "ingest/grid/occupancy_grid.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A large box of free cells around `cell`, in the map, grown side by side in turn, at most
/// `reach_m` to each. Empty when the cell itself is not free.
Box3d GrowFreeBox(const OccupancyGrid& grid, const Eigen::Vector3i& cell, double reach_m);

}  // namespace dsg::ingest
