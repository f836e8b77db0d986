// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/walk_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "query/prediction/goal_prediction.h"
#include "schema/base/random.h"

namespace dsg::query {
namespace {

TEST(FreeSpace, IsThatOfTheBestPlace) {
  WalkGraph graph;
  graph.places_map = {{0, 0, 1}, {1, 0, 1}, {0, 0, 5}};
  graph.clearance_m = {0.5, 0.8, 2.0};
  const FreeSpace space = *FreeSpace::Make(graph, {});
  EXPECT_NEAR(space.RadiusM({0.3, 0, 1}), 0.2, 1e-12);
  EXPECT_NEAR(space.RadiusM({0.7, 0, 1}), 0.5, 1e-12);
  EXPECT_NEAR(space.RadiusM({0.7, 0, 5}), 1.3, 1e-12);
  EXPECT_LT(space.RadiusM({9, 9, 1}), 0.0);
}

TEST(FreeSpace, KnowsLinesThatBendAroundNothing) {
  WalkGraph graph;
  graph.places_map = {{0, 0, 1}, {0.8, 0, 1}, {1.6, 0, 1}, {4, 0, 1}};
  graph.clearance_m = {0.6, 0.6, 0.6, 0.6};
  const FreeSpace space = *FreeSpace::Make(graph, {});
  EXPECT_TRUE(space.IsClear({0, 0, 1}, {1.6, 0.2, 1}, 0.15));
  EXPECT_FALSE(space.IsClear({0, 0, 1}, {1.6, 0.2, 1}, 0.5));
  EXPECT_FALSE(space.IsClear({1.6, 0, 1}, {4, 0, 1}, 0.15)) << "between lies what nobody saw";
  EXPECT_TRUE(space.IsClear({0, 0, 1}, {0, 0, 1}, 0.15));
}

TEST(FreeSpace, NeverCallsALineFreeThatLeavesAllClearances) {
  constexpr uint64_t kSeed = 12;
  std::cout << "seed " << kSeed << "\n";
  Random random(kSeed, 0);
  WalkGraph graph;
  for (int i = 0; i < 60; ++i) {
    graph.places_map.emplace_back(random.Uniform(0, 8), random.Uniform(0, 8), 1.0);
    graph.clearance_m.push_back(random.Uniform(0.3, 1.2));
  }
  const FreeSpace space = *FreeSpace::Make(graph, {});
  const auto is_free = [&](const Eigen::Vector3d& point_map) {
    for (size_t i = 0; i < graph.places_map.size(); ++i) {
      if ((graph.places_map[i] - point_map).norm() <= graph.clearance_m[i]) return true;
    }
    return false;
  };
  int clear_count = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d a(random.Uniform(0, 8), random.Uniform(0, 8), 1.0);
    const Eigen::Vector3d b = a + Eigen::Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), 0);
    if (!space.IsClear(a, b, 0.06)) continue;
    ++clear_count;
    for (int part = 0; part <= 200; ++part) ASSERT_TRUE(is_free(a + (b - a) * part / 200.0));
  }
  EXPECT_GT(clear_count, 300);
}

}  // namespace
}  // namespace dsg::query
