// SPDX-License-Identifier: Apache-2.0
// Random mazes whose places and links are free by construction, and walls to tell who left them.
// Refuses to know predictions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/prediction/goal_prediction.h"
#include "schema/base/random.h"

namespace dsg::query {

struct Wall {
  Eigen::Vector2d a;
  Eigen::Vector2d b;
};

double DistanceToWall(const Eigen::Vector2d& p, const Wall& wall);

/// Square cells. Walls stand on all borders but where a door of 0.9 m was made.
struct Maze {
  std::vector<Wall> walls;
  WalkGraph graph;
  int cell_count_side = 0;
  double cell_m = 0.0;

  /// To the nearest wall, at most a cell.
  double ClearanceM(const Eigen::Vector3d& point_map) const;
  /// Who walks along the line of a wall, in a door of it, does not cross it.
  bool IsCrossed(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
};

/// A place in the middle of each cell and one in each door.
Maze MakeMaze(Random* random);

/// Places anywhere in their cells, so that links go through doors at all angles, with what each
/// link keeps from walls.
Maze MakeCrookedMaze(Random* random);

}  // namespace dsg::query
