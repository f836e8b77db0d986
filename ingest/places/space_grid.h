// SPDX-License-Identifier: Apache-2.0
// Makes a grid fit to plan in: the robot's own path is free, what only looks free is not.
// Refuses to judge distances; see open_space.h.
#pragma once

#include <vector>

#include "ingest/grid/occupancy_grid.h"

namespace dsg::ingest {

/// The sizes, numbers and cells of a grid agree, and it can be measured.
bool IsSound(const OccupancyGrid& grid);

/// Frees what is within `footprint_m` of each point. Where more than a third of the footprint is
/// occupied the map and the path disagree, and the map is believed.
void StampPath(const std::vector<Eigen::Vector3d>& path_map, double footprint_m,
               OccupancyGrid* grid);

/// Free cells that no way over free cells joins to the path become unknown. Without a free cell
/// on the path nothing changes.
void KeepReached(const std::vector<Eigen::Vector3d>& path_map, OccupancyGrid* grid);

/// Free cells beside unknown space become unknown, since it may hide an obstacle. Single cells
/// that were missed do not count as unknown space.
void ShrinkFromUnknown(OccupancyGrid* grid);

}  // namespace dsg::ingest
