// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/landmarks.h"

#include <gtest/gtest.h>

#include "query/engine/planning/planning_annex.h"
#include "tests/unit/query/engine/planning/random_places.h"

namespace dsg::query {
namespace {

using test::NaiveWay;
using test::RandomAnchors;
using test::RandomLimits;
using test::RandomPlaces;

TEST(Guide, NeverSaysMoreThanTheWayIsLong) {
  for (uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 3);
    const RandomPlaces world = RandomPlaces::Make(&random);
    const Limits limits = RandomLimits(world, &random);
    const auto graph = world.Graph();
    LandmarkCache cache;
    const auto landmarks = cache.Get(*graph, limits, {});
    ASSERT_TRUE(landmarks.ok());
    std::vector<Anchor> goals = RandomAnchors(world, &random);
    std::erase_if(goals, [&](const Anchor& goal) { return !limits.Admits(*graph, goal.place); });
    if (goals.empty()) continue;
    const Guide guide(*graph, goals, landmarks->get());
    for (PlaceIndex place = 0; place < graph->size(); ++place) {
      const auto way_m = NaiveWay(world, limits, {{place, 0.0, {}}}, goals);
      if (!way_m.has_value()) continue;
      ASSERT_TRUE(guide.MayReach(place));
      EXPECT_LE(guide.AtLeast(place), *way_m + 1e-9);
    }
  }
}

TEST(LandmarkCache, KeepsAFewSetsOnly) {
  Random random(5, 4);
  const auto graph = RandomPlaces::Make(&random).Graph();
  LandmarkCache cache;
  size_t bytes_max = 0;
  for (int i = 0; i < 40; ++i) {
    Limits limits;
    limits.radius_m = 0.0625 * i;
    ASSERT_TRUE(cache.Get(*graph, limits, {}).ok());
    if (i == 3) bytes_max = cache.memory_bytes();
  }
  EXPECT_EQ(cache.memory_bytes(), bytes_max);
}

TEST(LandmarkCache, MeasuresAgainAfterABuilderWasStopped) {
  Random random(5, 4);
  const auto graph = RandomPlaces::Make(&random).Graph();
  LandmarkCache cache;
  const StopCheck stop = [] { return absl::CancelledError("gone"); };
  EXPECT_TRUE(absl::IsCancelled(cache.Get(*graph, {}, stop).status()));
  EXPECT_TRUE(cache.Get(*graph, {}, {}).ok());
}

TEST(LandmarkCache, TakesRadiiThatNoPlaceHas) {
  Random random(5, 4);
  const auto graph = RandomPlaces::Make(&random).Graph();
  LandmarkCache cache;
  Limits limits;
  limits.radius_m = 1e300;
  EXPECT_TRUE(cache.Get(*graph, limits, {}).ok());
}

TEST(PlanningAnnex, CountsTowardsTheMemoryOfTheGraph) {
  Random random(5, 4);
  const auto graph = RandomPlaces::Make(&random).Graph();
  const size_t before = graph->memory_bytes();
  PlanningAnnex& annex = **PlanningAnnex::Of(*graph, {});
  EXPECT_GT(graph->memory_bytes(), before);
  const size_t between = graph->memory_bytes();
  ASSERT_TRUE(annex.landmarks().Get(*graph, {}, {}).ok());
  EXPECT_GT(graph->memory_bytes(), between);
}

}  // namespace
}  // namespace dsg::query
