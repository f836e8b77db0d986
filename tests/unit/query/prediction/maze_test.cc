// SPDX-License-Identifier: Apache-2.0
// Predictions among walls: random mazes whose places and links are free by construction.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "query/prediction/goal_choice.h"
#include "query/prediction/goal_prediction.h"
#include "schema/base/random.h"
#include "tests/unit/query/prediction/mazes.h"
#include "tests/unit/query/prediction/path_points.h"

namespace dsg::query {
namespace {

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

/// Within the clearance of a place or of a link, or not, by looking at all of them.
bool IsProven(const Maze& maze, const std::vector<double>& link_clearance_m,
              const Eigen::Vector3d& position_map) {
  constexpr double kTinyM = 1e-6;
  const WalkGraph& graph = maze.graph;
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    const double way_m = (position_map - graph.places_map[i]).head<2>().norm();
    if (way_m <= graph.clearance_m[i] + kTinyM) return true;
  }
  for (size_t i = 0; i < graph.links.size(); ++i) {
    const Wall line{graph.places_map[graph.links[i].first].head<2>(),
                    graph.places_map[graph.links[i].second].head<2>()};
    if (DistanceToWall(position_map.head<2>(), line) <= link_clearance_m[i] + kTinyM) return true;
  }
  return false;
}

/// Looked at every four centimetres.
bool LeavesProvenSpace(const Maze& maze, const std::vector<double>& link_clearance_m,
                       const std::vector<PathPoint>& path, const PredictedPath& predicted) {
  Eigen::Vector3d before = path.back().position_map;
  for (const Eigen::Vector3d& position : predicted.positions_map) {
    const int part_count = 1 + static_cast<int>((position - before).norm() / 0.04);
    for (int part = 1; part <= part_count; ++part) {
      const Eigen::Vector3d at_map = before + (position - before) * part / part_count;
      if (!IsProven(maze, link_clearance_m, at_map)) return true;
    }
    before = position;
  }
  return false;
}

/// Anything that is allowed and does something.
GoalOptions AnyOptions(double clearance_m_max, Random* random) {
  GoalOptions options;
  options.detour_m = random->Uniform(0.05, 10.0);
  options.path_count_max = 1000;
  options.look_ahead_m = random->Uniform(0.05, 10.0);
  options.blend_s = random->Chance(0.2) ? 0.0 : random->Uniform(0.0, 20.0);
  options.clearance_m_min = random->Uniform(0.05, clearance_m_max);
  options.decay = random->Uniform(0.0, 1.0);
  options.merge_m = random->Uniform(0.01, 5.0);
  options.standing_m_s = random->Uniform(0.01, 0.3);
  options.attach_m_max = random->Uniform(0.0, 3.0);
  options.heading = random->Uniform(0.0, 50.0);
  options.straight_m_min = random->Uniform(0.1, 0.6);
  options.way_m_max = random->Uniform(2.0, 60.0);
  options.walking_m_s = random->Uniform(0.0, 3.0);
  options.pace_change_m_s_min = random->Uniform(0.01, 0.5);
  return options;
}

GoalField FieldOf(const Maze& maze, Random* random) {
  GoalChoiceOptions choice;
  choice.anywhere_m = random->Uniform(0.5, 4.0);
  std::vector<Goal> goals;
  for (const ChosenGoal& chosen : ChooseGoals(maze.graph, {}, choice)) {
    goals.push_back(chosen.goal);
  }
  return GoalField(maze.graph, goals);
}

/// Nobody is faster than 3 m / s; of that, steps of a walk may be two of 0.1 m out.
bool Jumps(const std::vector<PathPoint>& path, const PredictedPath& predicted, double period_s) {
  Eigen::Vector3d before = path.back().position_map;
  for (const Eigen::Vector3d& position : predicted.positions_map) {
    if ((position - before).norm() > 3.0 * period_s + 0.2) return true;
    before = position;
  }
  return false;
}

TEST(PredictToGoals, NeverLeavesProvenSpaceWhateverTheOptions) {
  constexpr uint64_t kSeed = 7;
  std::cout << "seed " << kSeed << "\n";
  Random random(kSeed, 0);
  std::vector<TimeNs> at_ns;
  for (int i = 0; i <= 120; ++i) at_ns.push_back(kSecond + i * (kSecond / 20));
  int future_count = 0;
  int alone_count = 0;
  for (int round = 0; round < 80; ++round) {
    Maze maze = MakeCrookedMaze(&random);
    const std::vector<double> link_clearance_m = maze.graph.link_clearance_m;
    double clearance_m_max = 1.5;
    if (random.Chance(0.5)) {
      // What is not said of links has to be true of them.
      clearance_m_max = *std::min_element(link_clearance_m.begin(), link_clearance_m.end());
      maze.graph.link_clearance_m.clear();
    }
    const GoalField field = FieldOf(maze, &random);
    const GoalOptions options = AnyOptions(clearance_m_max, &random);
    std::vector<double> kept_m = link_clearance_m;
    for (double& kept : kept_m) kept = std::min(kept, options.clearance_m_min - 1e-3);
    for (int i = 0; i < 8; ++i) {
      const std::vector<PathPoint> path = WalkOnALink(maze, &random);
      // Who is in no clearance comes onto the graph by a way that nothing proves.
      if (!IsProven(maze, kept_m, path.back().position_map)) continue;
      for (const PredictedPath& predicted : PredictToGoals(path, at_ns, field, options)) {
        ++future_count;
        alone_count += predicted.goal < 0;
        SCOPED_TRACE(testing::Message() << "round " << round << " walk " << i);
        ASSERT_FALSE(LeavesProvenSpace(maze, link_clearance_m, path, predicted));
        ASSERT_FALSE(CrossesWalls(maze, path, predicted));
        ASSERT_FALSE(Jumps(path, predicted, 0.05));
      }
    }
  }
  std::cout << future_count << " futures, " << alone_count << " without a goal\n";
  EXPECT_GT(future_count, 2000);
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
