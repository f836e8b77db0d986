// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>

#include "query/prediction/goal_prediction.h"
#include "query/prediction/ways.h"
#include "schema/base/random.h"

namespace dsg::query {
namespace {

/// 0 - 1 - 2 in a row, 3 alone.
WalkGraph RowAndIsland() {
  WalkGraph graph;
  graph.places_map = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {9, 9, 0}};
  graph.clearance_m = {1, 1, 1, 1};
  graph.links = {{0, 1}, {2, 1}};
  return graph;
}

/// From a place itself.
Ways WaysFrom(int place, const GoalField& field, double way_m_max = 1e9) {
  return *Ways::Find({{place, field.graph().places_map[place], 0.0}}, field, way_m_max, {});
}

TEST(Ways, KnowTheirLengthAndPlaces) {
  const GoalField field(RowAndIsland(), {});
  const Ways ways = WaysFrom(2, field);
  EXPECT_EQ(ways.WayM(0), 3.0);
  EXPECT_EQ(ways.PlacesTo(0), (std::vector<int>{2, 1, 0}));
  EXPECT_EQ(ways.PlacesTo(2), (std::vector<int>{2}));
  EXPECT_EQ(ways.Origin(0), 0);
}

TEST(Ways, SayWhereThereIsNone) {
  const GoalField field(RowAndIsland(), {});
  EXPECT_TRUE(std::isinf(WaysFrom(3, field).WayM(0)));
  EXPECT_FALSE(WaysFrom(3, field).Reaches(0));
  EXPECT_EQ(WaysFrom(3, field).WayM(3), 0.0);
}

TEST(Ways, EndWhereTheyGrowTooLong) {
  const GoalField field(RowAndIsland(), {});
  const Ways ways = WaysFrom(0, field, 2.5);
  EXPECT_TRUE(ways.Reaches(1));
  EXPECT_FALSE(ways.Reaches(2));
}

TEST(Ways, BeginWhereTheWholeIsShortest) {
  const GoalField field(RowAndIsland(), {});
  const Ways ways = *Ways::Find({{0, {0, 0, 0}, 1.5}, {2, {3, 0, 0}, 0.1}}, field, 1e9, {});
  EXPECT_EQ(ways.Origin(0), 0);
  EXPECT_EQ(ways.Origin(1), 1);
  EXPECT_NEAR(ways.WayM(1), 2.1, 1e-12);
  EXPECT_EQ(ways.PlacesTo(1), (std::vector<int>{2, 1}));
}

TEST(Ways, AgreeWithEveryPairTriedByForce) {
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
  const GoalField field(graph, {});
  for (const int from : {5, 17}) {
    const Ways ways = WaysFrom(from, field);
    for (int place = 0; place < kPlaceCount; ++place) {
      ASSERT_EQ(ways.Reaches(place), !std::isinf(way_m[place][from]));
      if (!ways.Reaches(place)) continue;
      EXPECT_NEAR(ways.WayM(place), way_m[place][from], 1e-9);
      const std::vector<int> places = ways.PlacesTo(place);
      double walked_m = 0.0;
      for (size_t i = 1; i < places.size(); ++i) walked_m += way_m[places[i - 1]][places[i]];
      EXPECT_NEAR(walked_m, ways.WayM(place), 1e-9);
    }
  }
}

TEST(GoalFieldDeathTest, RefusesLinksAndGoalsOutsideThePlaces) {
  WalkGraph graph = RowAndIsland();
  EXPECT_DEATH(GoalField(graph, {{4}}), "IsPlace");
  graph.links.emplace_back(0, -1);
  EXPECT_DEATH(GoalField(graph, {}), "IsPlace");
  graph = RowAndIsland();
  graph.clearance_m.pop_back();
  EXPECT_DEATH(GoalField(graph, {}), "clearance");
  graph = RowAndIsland();
  graph.places_map[0].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(GoalField(graph, {}), "allFinite");
}

}  // namespace
}  // namespace dsg::query
