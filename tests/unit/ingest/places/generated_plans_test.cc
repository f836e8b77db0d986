// SPDX-License-Identifier: Apache-2.0
// Places in buildings of the simulator, mapped with noise, against their true free space.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "tests/unit/ingest/places/plan_map.h"

namespace dsg::ingest {
namespace {

using simulator::WorldKind;

struct Plan {
  WorldKind kind;
  uint64_t seed;
};

class GeneratedPlans : public testing::TestWithParam<Plan> {};

TEST_P(GeneratedPlans, AreCoveredAndWalkableThroughout) {
  const PlanMap map = MapPlan(GetParam().kind, GetParam().seed, 0.02);
  PlaceOptions options;
  options.floors_m = {0.0};
  const auto begin = std::chrono::steady_clock::now();
  const PlaceGraph graph = ExtractPlaces(map.grid, map.path_map, options);
  std::printf("%.2f s ",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  const evaluation::PlaceResult result = Score(graph, map.truth);
  std::printf(
      "seed %d: %d places, %d links, free %.4f, coverage %.4f, stretch %.3f, "
      "connected %.3f, %.0f per 100 m2\n",
      static_cast<int>(GetParam().seed), static_cast<int>(result.place_count),
      static_cast<int>(result.edge_count), result.collision_free_ratio.value_or(0.0),
      result.coverage.value_or(0.0), result.stretch_median.value_or(0.0),
      result.connectivity.value_or(0.0), result.per_100_m2.value_or(0.0));
  EXPECT_EQ(result.collision_free_ratio.value_or(0.0), 1.0);
  EXPECT_GE(result.coverage.value_or(0.0), 0.98);
  EXPECT_LE(result.stretch_median.value_or(9.0), 1.15);
  EXPECT_GE(result.connectivity.value_or(0.0), 0.99);
  EXPECT_GE(result.per_100_m2.value_or(0.0), 40.0);
  EXPECT_LE(result.per_100_m2.value_or(0.0), 120.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GeneratedPlans,
                         testing::Values(Plan{WorldKind::kApartment, 1},
                                         Plan{WorldKind::kApartment, 2},
                                         Plan{WorldKind::kApartment, 3},
                                         Plan{WorldKind::kApartment, 4},
                                         Plan{WorldKind::kApartment, 5}, Plan{WorldKind::kWing, 1},
                                         Plan{WorldKind::kOffice, 1}));

}  // namespace
}  // namespace dsg::ingest
