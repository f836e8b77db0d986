// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/prediction/mazes.h"

#include <algorithm>
#include <cmath>

namespace dsg::query {
namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Not who walks along the line of a wall, in a door of it.
bool Crosses(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Wall& wall) {
  const double side_p = Cross(wall.b - wall.a, p - wall.a);
  const double side_q = Cross(wall.b - wall.a, q - wall.a);
  const double side_a = Cross(q - p, wall.a - p);
  const double side_b = Cross(q - p, wall.b - p);
  return (side_p * side_q < 0 && side_a * side_b <= 0) || DistanceToWall(q, wall) < 1e-6;
}

/// Further from a wall's end than this along an axis, which is quick to see.
bool IsFar(const Eigen::Vector3d& point_map, const Wall& wall, double far_m) {
  return std::abs(point_map.x() - wall.a.x()) > far_m ||
         std::abs(point_map.y() - wall.a.y()) > far_m;
}

constexpr double kDoorM = 0.9;

void AddBorder(const Eigen::Vector2d& a, const Eigen::Vector2d& b, bool has_door, int cell_a,
               int cell_b, Maze* maze) {
  if (!has_door) {
    maze->walls.push_back({a, b});
    return;
  }
  const Eigen::Vector2d middle = 0.5 * (a + b);
  const Eigen::Vector2d half_door = 0.5 * kDoorM * (b - a).normalized();
  maze->walls.push_back({a, middle - half_door});
  maze->walls.push_back({middle + half_door, b});
  const int door = static_cast<int>(maze->graph.places_map.size());
  maze->graph.places_map.emplace_back(middle.x(), middle.y(), 1.0);
  maze->graph.links.emplace_back(cell_a, door);
  maze->graph.links.emplace_back(door, cell_b);
}

}  // namespace

double DistanceToWall(const Eigen::Vector2d& p, const Wall& wall) {
  const Eigen::Vector2d along = wall.b - wall.a;
  const double share = std::clamp((p - wall.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - wall.a - share * along).norm();
}
double Maze::ClearanceM(const Eigen::Vector3d& point_map) const {
  double clearance_m = cell_m;
  for (const Wall& wall : walls) {
    if (IsFar(point_map, wall, 2.0 * cell_m)) continue;
    clearance_m = std::min(clearance_m, DistanceToWall(point_map.head<2>(), wall));
  }
  return clearance_m;
}

bool Maze::IsCrossed(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const {
  const double far_m = cell_m + (q - p).norm();
  return std::any_of(walls.begin(), walls.end(), [&](const Wall& wall) {
    return !IsFar(p, wall, far_m) && Crosses(p.head<2>(), q.head<2>(), wall);
  });
}

Maze MakeMaze(Random* random) {
  Maze maze;
  maze.cell_count_side = 6;
  maze.cell_m = random->Uniform(1.6, 4.0);
  const int n = maze.cell_count_side;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const Eigen::Vector2d middle((x + 0.5) * maze.cell_m, (y + 0.5) * maze.cell_m);
      maze.graph.places_map.emplace_back(middle.x(), middle.y(), 1.0);
    }
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const Eigen::Vector2d corner = Eigen::Vector2d(x + 1, y + 1) * maze.cell_m;
      const int cell = y * n + x;
      AddBorder(corner - Eigen::Vector2d(0, maze.cell_m), corner, x + 1 < n && random->Chance(0.75),
                cell, cell + 1, &maze);
      AddBorder(corner - Eigen::Vector2d(maze.cell_m, 0), corner, y + 1 < n && random->Chance(0.75),
                cell, cell + n, &maze);
    }
  }
  for (const Eigen::Vector3d& place_map : maze.graph.places_map) {
    maze.graph.clearance_m.push_back(maze.ClearanceM(place_map));
  }
  return maze;
}
Maze MakeCrookedMaze(Random* random) {
  Maze maze = MakeMaze(random);
  WalkGraph& graph = maze.graph;
  const size_t cell_count = static_cast<size_t>(maze.cell_count_side * maze.cell_count_side);
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    if (i < cell_count) {
      const double shift_m = 0.3 * maze.cell_m;
      graph.places_map[i] += Eigen::Vector3d(random->Uniform(-shift_m, shift_m),
                                             random->Uniform(-shift_m, shift_m), 0.0);
    }
    graph.clearance_m[i] = maze.ClearanceM(graph.places_map[i]);
  }
  constexpr double kPartM = 0.01;
  for (const auto& [a, b] : graph.links) {
    const Eigen::Vector3d way = graph.places_map[b] - graph.places_map[a];
    const int part_count = 1 + static_cast<int>(way.norm() / kPartM);
    double clearance_m = maze.cell_m;
    for (int part = 0; part <= part_count; ++part) {
      const Eigen::Vector3d at_map = graph.places_map[a] + way * part / part_count;
      clearance_m = std::min(clearance_m, maze.ClearanceM(at_map));
    }
    graph.link_clearance_m.push_back(clearance_m - kPartM);
  }
  return maze;
}

}  // namespace dsg::query
