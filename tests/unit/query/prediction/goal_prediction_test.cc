// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "query/prediction/goal_prediction.h"
#include "tests/unit/query/prediction/path_points.h"

namespace dsg::query {
namespace {

/// From one second on, ten times a second.
std::vector<TimeNs> Tenths(int count) {
  std::vector<TimeNs> at_ns;
  for (int i = 0; i <= count; ++i) at_ns.push_back(kSecond + i * (kSecond / 10));
  return at_ns;
}

/// A T: a corridor along x that ends at x = 10, with arms to y = 8 and y = -8.
WalkGraph Junction() {
  WalkGraph graph;
  for (int i = 0; i <= 10; ++i) graph.places_map.emplace_back(i, 0, 1.2);
  for (int i = 1; i <= 8; ++i) graph.places_map.emplace_back(10, i, 1.2);
  for (int i = 1; i <= 8; ++i) graph.places_map.emplace_back(10, -i, 1.2);
  graph.clearance_m.assign(graph.places_map.size(), 0.8);
  for (int i = 0; i < 18; ++i) graph.links.emplace_back(i, i + 1);
  graph.links.emplace_back(10, 19);
  for (int i = 19; i < 26; ++i) graph.links.emplace_back(i, i + 1);
  return graph;
}
constexpr int kLeftEnd = 18;
constexpr int kRightEnd = 26;

TEST(PredictToGoals, OffersBothArmsOfAJunction) {
  const std::vector<PredictedPath> paths = PredictToGoals(
      {At(0, 5, 0), At(1, 6, 0)}, Tenths(80), Junction(), {{kLeftEnd}, {kRightEnd}}, {});
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_NEAR(paths[0].probability, 0.5, 1e-9);
  const Eigen::Vector3d left = paths[0].positions_map.back();
  const Eigen::Vector3d right = paths[1].positions_map.back();
  EXPECT_NEAR(left.y(), 4.0, 0.6);
  EXPECT_NEAR(right.y(), -4.0, 0.6);
  EXPECT_NEAR(left.x(), 10.0, 0.3);
  EXPECT_NEAR(left.z(), 0.9, 1e-9) << "people stay at their own height above the floor";
  EXPECT_NEAR(paths[0].sigma_m.back(), 0.25 * 8.0, 1e-9);
}

TEST(PredictToGoals, IsOneFutureWhileAllGoalsLeadTheSameWay) {
  const std::vector<PredictedPath> paths = PredictToGoals(
      {At(0, 1, 0), At(1, 2, 0)}, Tenths(50), Junction(), {{kLeftEnd}, {kRightEnd}}, {});
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_NEAR(paths[0].probability, 1.0, 1e-9);
  EXPECT_NEAR(paths[0].positions_map.back().x(), 7.0, 0.1);
}

TEST(PredictToGoals, BelievesInGoalsThatAreApproached) {
  const GoalField field(Junction(), {{0}, {kLeftEnd}, {kRightEnd}});
  GoalOptions options;
  options.detour_m = 1.0;
  const std::vector<double> probabilities =
      GoalProbabilities({At(0, 10, 0), At(1, 10, 1), At(2, 10, 2)}, field, options);
  // Two metres towards one goal, two away from both others.
  EXPECT_NEAR(probabilities[1], 1.0 / (1.0 + 2.0 * std::exp(-4.0)), 1e-9);
  EXPECT_NEAR(std::accumulate(probabilities.begin(), probabilities.end(), 0.0), 1.0, 1e-12);
}

TEST(PredictToGoals, WeighsGoalsByWhatWasKnownBefore) {
  const GoalField field(Junction(), {{kLeftEnd, 3.0}, {kRightEnd, 1.0}, {0, 0.0}});
  const std::vector<double> probabilities =
      GoalProbabilities({At(0, 5, 0), At(1, 6, 0)}, field, {});
  EXPECT_NEAR(probabilities[0], 0.75, 1e-9);
  EXPECT_EQ(probabilities[2], 0.0);
}

TEST(PredictToGoals, StopsAtTheGoal) {
  const std::vector<PredictedPath> paths = PredictToGoals(
      {At(0, 1, 0.3), At(1, 2, 0.3)}, {kSecond, 100 * kSecond}, Junction(), {{4}}, {});
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_NEAR((paths[0].positions_map[0] - Eigen::Vector3d(2, 0.3, 0.9)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((paths[0].positions_map[1] - Eigen::Vector3d(4, 0, 0.9)).norm(), 0.0, 1e-6);
}

TEST(PredictToGoals, LeavesStandingPeopleWhereTheyAre) {
  for (const std::vector<PathPoint>& path :
       {std::vector<PathPoint>{At(1, 3, 0)}, {At(0, 3, 0), At(1, 3.05, 0)}}) {
    const std::vector<PredictedPath> paths =
        PredictToGoals(path, {9 * kSecond}, Junction(), {{kLeftEnd}}, {});
    ASSERT_EQ(paths.size(), 1u);
    EXPECT_EQ(paths[0].positions_map[0], path.back().position_map);
    EXPECT_NEAR(paths[0].sigma_m[0], 2.0, 1e-9);
  }
}

TEST(PredictToGoals, IsConstantVelocityWithoutAGraph) {
  const std::vector<PathPoint> path = {At(0, 3, 0), At(1, 3, 1)};
  const std::vector<PathPoint> outside = {At(0, 3, 30), At(1, 3, 31)};
  const std::vector<PathPoint> upstairs = {{0, {3, 0, 4}}, {kSecond, {3, 1, 4}}};
  const auto only = [](const std::vector<PathPoint>& seen, const WalkGraph& graph,
                       const std::vector<Goal>& goals) {
    const auto paths = PredictToGoals(seen, {3 * kSecond}, graph, goals, {});
    EXPECT_EQ(paths.size(), 1u);
    EXPECT_EQ(paths[0].probability, 1.0);
    return (paths[0].positions_map[0] - seen.back().position_map).eval();
  };
  const Eigen::Vector3d straight(0, 2, 0);
  EXPECT_NEAR((only(path, {}, {}) - straight).norm(), 0, 1e-12);
  EXPECT_NEAR((only(outside, Junction(), {}) - straight).norm(), 0, 1e-12);
  EXPECT_NEAR((only(outside, Junction(), {{0}}) - straight).norm(), 0, 1e-12);
  EXPECT_NEAR((only(upstairs, Junction(), {{0}}) - straight).norm(), 0, 1e-12);
}

TEST(PredictToGoals, IgnoresGoalsWithoutAWay) {
  WalkGraph graph = Junction();
  graph.places_map.emplace_back(5, 3, 1.2);
  graph.clearance_m.push_back(0.5);
  const int island = static_cast<int>(graph.places_map.size()) - 1;
  const std::vector<PathPoint> path = {At(0, 5, 0), At(1, 6, 0)};
  const auto paths = PredictToGoals(path, {5 * kSecond}, graph, {{island}, {kLeftEnd}}, {});
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_NEAR(paths[0].probability, 1.0, 1e-12);
  const auto alone = PredictToGoals(path, {5 * kSecond}, graph, {{island}}, {});
  EXPECT_NEAR(alone[0].positions_map[0].x(), 10.0, 1e-9) << "constant velocity";
  EXPECT_NEAR(alone[0].positions_map[0].y(), 0.0, 1e-9) << "constant velocity";
}

TEST(PredictToGoals, OverlooksAGapInTheGraphThatWasWalkedOver) {
  WalkGraph graph = Junction();
  graph.links.erase(graph.links.begin() + 4);
  const auto paths =
      PredictToGoals({At(-2, 3, 0), At(0, 5, 0), At(1, 6, 0)}, Tenths(50), graph, {{kLeftEnd}}, {});
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_GT(paths[0].positions_map.back().y(), 0.5);
}

TEST(PredictToGoals, WaitsAtTheEdgeOfFreeSpaceWithoutAGoal) {
  const auto paths = PredictToGoals({At(0, 2, 0), At(1, 3, 0.2)}, Tenths(50), Junction(), {}, {});
  ASSERT_EQ(paths.size(), 1u);
  for (const Eigen::Vector3d& position : paths[0].positions_map) {
    EXPECT_LE(std::abs(position.y()), 0.8);
  }
  EXPECT_GT(paths[0].positions_map.back().y(), 0.6);
  EXPECT_EQ(paths[0].positions_map[40], paths[0].positions_map[50]);
}

TEST(PredictToGoals, HoldsBackJumpsThatNobodyRuns) {
  const auto paths = PredictToGoals({At(0, 1, 0), At(1, 1.001, 0), {kSecond + 1, {2, 0, 0.9}}},
                                    {2 * kSecond + 1}, Junction(), {{kLeftEnd}}, {});
  EXPECT_LE((paths[0].positions_map[0] - Eigen::Vector3d(2, 0, 0.9)).norm(), 3.0 + 1e-9);
}

TEST(PredictToGoals, KeepsTheMostProbableFutures) {
  GoalOptions options;
  options.path_count_max = 1;
  const auto paths = PredictToGoals({At(0, 8, 0), At(1, 9, 0)}, Tenths(50), Junction(),
                                    {{kLeftEnd, 1.0}, {kRightEnd, 2.0}}, options);
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_NEAR(paths[0].probability, 2.0 / 3.0, 1e-9);
  EXPECT_LT(paths[0].positions_map.back().y(), -1.0);
}

TEST(PredictToGoalsDeathTest, RefusesWhatIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(PredictToGoals({At(0, nan, 0)}, {}, WalkGraph(), {}, {}), "allFinite");
  GoalOptions options;
  options.detour_m = nan;
  EXPECT_DEATH(PredictToGoals({At(0, 0, 0)}, {}, WalkGraph(), {}, options), "detour_m");
}

}  // namespace
}  // namespace dsg::query
