// SPDX-License-Identifier: Apache-2.0
// From free space to a sparse graph of places.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/places/place_graph.h"
#include "ingest/places/place_options.h"

namespace dsg::ingest {

/// What `grid` looks like to a body that stands on the floor at `floor_z_m`: one cell high,
/// occupied where any cell of the body's height is or where one sees down past the floor, free
/// where enough of the column, and of its lower half, was seen to be, and nothing like a thin
/// board in between was missed. Empty for a grid whose numbers do not agree.
OccupancyGrid ProjectToFloor(const OccupancyGrid& grid, double floor_z_m,
                             const PlaceOptions& options);

/// Heights of floors in a grid, ascending: levels a storey apart with free space above
/// something flat, to within a cell. `path` is where the robot's body has been; floors that it
/// never was on are left out, if it was on any.
std::vector<double> FindFloors(const OccupancyGrid& grid, const std::vector<Eigen::Vector3d>& path,
                               const PlaceOptions& options);

/// Places without ids. `path_map`: where the robot has been; that is free by construction.
/// Every link is proven: all cells that it passes were seen to be free, and the middles of all
/// obstacle cells are at least half a cell further away than the robot's radius. Such links stay
/// on one floor; ways between floors are those that the robot went (LinkStoreys), and not proven
/// otherwise. Places without links are where a robot does not get to, but sees.
///
/// Cost: 65 m x 65 m of offices at 0.1 m in about a second.
/// Order: the same input gives the same places in the same order.
/// Source: RSS 2020, section IV-B; Oleynikova et al., 2018; Hughes et al., 2022.
PlaceGraph ExtractPlaces(const OccupancyGrid& grid, const std::vector<Eigen::Vector3d>& path_map,
                         const PlaceOptions& options);

}  // namespace dsg::ingest
