// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>

#include "query/prediction/prediction.h"
#include "schema/base/random.h"

namespace dsg::query {
namespace {

/// 0 - 1 - 2 in a row, 3 alone.
WalkGraph Row() {
  WalkGraph graph;
  graph.places_map = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {9, 9, 0}};
  graph.clearance_m = {1, 1, 1, 1};
  graph.links = {{0, 1}, {2, 1}};
  return graph;
}

TEST(GoalField, KnowsTheWayAndItsLength) {
  const GoalField field(Row(), {{2}, {3}});
  EXPECT_EQ(field.DistanceM(0, 0), 3.0);
  EXPECT_EQ(field.NextPlace(0, 0), 1);
  EXPECT_EQ(field.NextPlace(0, 1), 2);
  EXPECT_EQ(field.NextPlace(0, 2), -1);
}

TEST(GoalField, SaysWhereThereIsNoWay) {
  const GoalField field(Row(), {{3}});
  EXPECT_TRUE(std::isinf(field.DistanceM(0, 0)));
  EXPECT_EQ(field.NextPlace(0, 0), -1);
  EXPECT_EQ(field.DistanceM(0, 3), 0.0);
}

TEST(GoalField, AgreesWithEveryPairTriedByForce) {
  constexpr uint64_t kSeed = 71;
  std::cout << "seed " << kSeed << "\n";
  Random random(kSeed, 0);
  constexpr int kPlaceCount = 40;
  WalkGraph graph;
  for (int i = 0; i < kPlaceCount; ++i) {
    graph.places_map.emplace_back(random.Uniform(0, 10), random.Uniform(0, 10), 0);
    graph.clearance_m.push_back(0.5);
  }
  std::vector<std::vector<double>> way_m(
      kPlaceCount, std::vector<double>(kPlaceCount, std::numeric_limits<double>::infinity()));
  for (int i = 0; i < kPlaceCount; ++i) way_m[i][i] = 0.0;
  for (int i = 0; i < 55; ++i) {
    const int a = random.Index(kPlaceCount);
    const int b = random.Index(kPlaceCount);
    graph.links.emplace_back(a, b);
    const double length_m = (graph.places_map[a] - graph.places_map[b]).norm();
    way_m[a][b] = way_m[b][a] = std::min(way_m[a][b], length_m);
  }
  for (int k = 0; k < kPlaceCount; ++k) {
    for (int i = 0; i < kPlaceCount; ++i) {
      for (int j = 0; j < kPlaceCount; ++j) {
        way_m[i][j] = std::min(way_m[i][j], way_m[i][k] + way_m[k][j]);
      }
    }
  }
  const GoalField field(graph, {{5}, {17}});
  for (int place = 0; place < kPlaceCount; ++place) {
    for (const auto& [goal, goal_place] : {std::pair{0, 5}, std::pair{1, 17}}) {
      if (std::isinf(way_m[place][goal_place])) {
        EXPECT_TRUE(std::isinf(field.DistanceM(goal, place)));
        continue;
      }
      EXPECT_NEAR(field.DistanceM(goal, place), way_m[place][goal_place], 1e-9);
      const int next = field.NextPlace(goal, place);
      if (next < 0) continue;
      EXPECT_LT(field.DistanceM(goal, next), field.DistanceM(goal, place) + 1e-12);
    }
  }
}

TEST(GoalFieldDeathTest, RefusesLinksAndGoalsOutsideThePlaces) {
  WalkGraph graph = Row();
  EXPECT_DEATH(GoalField(graph, {{4}}), "IsPlace");
  graph.links.emplace_back(0, -1);
  EXPECT_DEATH(GoalField(graph, {}), "IsPlace");
  graph = Row();
  graph.clearance_m.pop_back();
  EXPECT_DEATH(GoalField(graph, {}), "clearance");
  graph = Row();
  graph.places_map[0].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(GoalField(graph, {}), "allFinite");
}

}  // namespace
}  // namespace dsg::query
