// SPDX-License-Identifier: Apache-2.0
// Grids to find places in: drawn by hand, or as a robot would map a world of the simulator.
// Refuses to judge the places; the evaluation does.
#pragma once

#include <string>
#include <vector>

#include "ingest/evaluation/places.h"
#include "ingest/grid/occupancy_grid.h"
#include "ingest/places/extract_places.h"
#include "ingest/simulator/world/world.h"
#include "ingest/truth/truth.h"

namespace dsg::ingest {

/// A room of free space without walls: `size_m` wide, the floor at z = 0, all of it seen.
OccupancyGrid MakeHall(const Eigen::Vector3d& size_m);
/// Fills the cells whose middle is in a box.
void Fill(const Eigen::Vector3d& low_map, const Eigen::Vector3d& high_map, Occupancy with,
          OccupancyGrid* grid);

struct PlanMap {
  OccupancyGrid grid;
  truth::FreeGrid truth;
  std::vector<Eigen::Vector3d> path_map;
};

/// The world's surfaces with `noise_m` of noise, as thick as a volume of 0.1 m voxels has them;
/// what no way leads to was never seen. The path visits all rooms.
PlanMap MapPlan(simulator::WorldKind kind, uint64_t seed, double noise_m);

/// The same places for the evaluation.
evaluation::PlaceResult Score(const PlaceGraph& graph, const truth::FreeGrid& truth);

}  // namespace dsg::ingest
