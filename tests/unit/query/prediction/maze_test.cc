// SPDX-License-Identifier: Apache-2.0
// Predictions among walls: random mazes whose places and links are free by construction.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "query/prediction/prediction.h"
#include "schema/base/random.h"

namespace dsg::query {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;

// A maze of square cells. Walls stand on all borders but where a door was made.
struct Wall {
  Eigen::Vector2d a;
  Eigen::Vector2d b;
};

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double DistanceToWall(const Eigen::Vector2d& p, const Wall& wall) {
  const Eigen::Vector2d along = wall.b - wall.a;
  const double share = std::clamp((p - wall.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - wall.a - share * along).norm();
}

/// Who walks along the line of a wall, in a door of it, does not cross it.
bool Crosses(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Wall& wall) {
  const double side_p = Cross(wall.b - wall.a, p - wall.a);
  const double side_q = Cross(wall.b - wall.a, q - wall.a);
  const double side_a = Cross(q - p, wall.a - p);
  const double side_b = Cross(q - p, wall.b - p);
  return (side_p * side_q < 0 && side_a * side_b <= 0) || DistanceToWall(q, wall) < 1e-6;
}

struct Maze {
  std::vector<Wall> walls;
  WalkGraph graph;
  int cell_count_side = 0;
  double cell_m = 0.0;

  bool IsCrossed(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const {
    return std::any_of(walls.begin(), walls.end(), [&p, &q](const Wall& wall) {
      return Crosses(p.head<2>(), q.head<2>(), wall);
    });
  }
};

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
    double clearance_m = maze.cell_m;
    for (const Wall& wall : maze.walls) {
      clearance_m = std::min(clearance_m, DistanceToWall(place_map.head<2>(), wall));
    }
    maze.graph.clearance_m.push_back(clearance_m);
  }
  return maze;
}

/// Along a link of the maze, beside it by up to 0.2 m, at a walking pace.
std::vector<PathPoint> WalkOnALink(const Maze& maze, Random* random) {
  const auto& [from, to] =
      maze.graph.links[random->Index(static_cast<int>(maze.graph.links.size()))];
  Eigen::Vector3d a = maze.graph.places_map[from];
  Eigen::Vector3d b = maze.graph.places_map[to];
  if (random->Chance(0.5)) std::swap(a, b);
  const Eigen::Vector3d ahead = (b - a).normalized();
  const Eigen::Vector3d beside =
      random->Uniform(-0.2, 0.2) * Eigen::Vector3d(-ahead.y(), ahead.x(), 0.0);
  const double speed_m_s = random->Uniform(0.3, 1.8);
  const double last_m = random->Uniform(0.0, (b - a).norm());
  std::vector<PathPoint> path;
  for (int i = 5; i >= 0; --i) {
    const double along_m = std::max(0.0, last_m - 0.2 * i * speed_m_s);
    path.push_back({kSecond - i * (kSecond / 5), a + along_m * ahead + beside});
  }
  return path;
}

bool CrossesWalls(const Maze& maze, const std::vector<PathPoint>& path,
                  const PredictedPath& predicted) {
  Eigen::Vector3d before = path.back().position_map;
  for (const Eigen::Vector3d& position : predicted.positions_map) {
    if (maze.IsCrossed(before, position)) return true;
    before = position;
  }
  return false;
}

TEST(PredictToGoals, NeverCrossesWallsThatConstantVelocityCrosses) {
  constexpr uint64_t kSeed = 5;
  std::cout << "seed " << kSeed << "\n";
  Random random(kSeed, 0);
  std::vector<TimeNs> at_ns;
  for (int i = 0; i <= 80; ++i) at_ns.push_back(kSecond + i * (kSecond / 10));
  int straight_crossing_count = 0;
  int walk_count = 0;
  int crossing_count = 0;
  int future_count = 0;
  for (int round = 0; round < 40; ++round) {
    const Maze maze = MakeMaze(&random);
    std::vector<Goal> goals;
    for (int i = 0; i < 12; ++i) {
      goals.push_back({random.Index(static_cast<int>(maze.graph.places_map.size()))});
    }
    const GoalField field(maze.graph, goals);
    GoalOptions options;
    options.clearance_m_min = random.Uniform(0.2, 0.44);
    // Long ones pull harder into walls.
    options.look_ahead_m = random.Uniform(0.5, 4.0);
    options.blend_s = random.Uniform(0.0, 4.0);
    for (int i = 0; i < 20; ++i) {
      const std::vector<PathPoint> path = WalkOnALink(maze, &random);
      // Someone at a link's end who never moved is told to stay.
      if (LastVelocity(path).velocity_map.norm() == 0.0) continue;
      ++walk_count;
      straight_crossing_count += CrossesWalls(maze, path, PredictConstantVelocity(path, at_ns, {}));
      // Cut off from every goal there is nothing but constant velocity.
      const std::vector<double> probabilities = GoalProbabilities(path, field, options);
      if (*std::max_element(probabilities.begin(), probabilities.end()) == 0.0) continue;
      for (const PredictedPath& predicted : PredictToGoals(path, at_ns, field, options)) {
        ++future_count;
        const bool crosses = CrossesWalls(maze, path, predicted);
        crossing_count += crosses;
        EXPECT_FALSE(crosses) << "round " << round << " walk " << i;
      }
    }
  }
  std::cout << straight_crossing_count << " of " << walk_count
            << " straight predictions cross walls, " << crossing_count << " of " << future_count
            << " on the graph\n";
  EXPECT_GT(straight_crossing_count, walk_count / 3);
  EXPECT_GT(future_count, walk_count);
}

}  // namespace
}  // namespace dsg::query
