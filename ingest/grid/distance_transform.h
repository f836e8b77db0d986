// SPDX-License-Identifier: Apache-2.0
// The exact Euclidean distance transform of a dense grid, with the nearest obstacle of every cell.
// Refuses to know about units and free space: cells in, squared cells out.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/grid/occupancy_grid.h"

namespace dsg::ingest {

/// No obstacle.
inline constexpr int32_t kNoObstacle = -1;

struct ObstacleDistances {
  /// Squared, between the middles of cells; kFarSquared where there is no obstacle.
  static constexpr int32_t kFarSquared = INT32_MAX;
  std::vector<int32_t> squared_cells;
  /// Index of the nearest occupied cell, the lowest of equally near ones; kNoObstacle = none.
  std::vector<int32_t> nearest;
};

/// Sides and cells that the transform can count.
bool CanMeasure(const GridFrame& frame);

/// The result does not depend on `thread_count`.
///
/// Requires: CanMeasure(grid.frame); as many cells as the frame says.
/// Cost: linear in the cells. Source: Meijster et al., 2000; Felzenszwalb and Huttenlocher, 2012.
ObstacleDistances MeasureObstacles(const OccupancyGrid& grid, int thread_count);

}  // namespace dsg::ingest
