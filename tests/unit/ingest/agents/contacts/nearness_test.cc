// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/contacts/nearness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/base/random.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

constexpr int kStepCount = 400;

Eigen::Vector3d RandomPoint(Random* random, double size_m) {
  return {random->Uniform(-size_m, size_m), random->Uniform(-size_m, size_m),
          random->Uniform(-size_m, size_m)};
}

// Walks the move in small steps and compares.
void CompareWithSteps(const Move& move, const Box3d& box, double limit_m) {
  const std::optional<NearSpan> span = NearBox(move, box, limit_m);
  // Between two steps the distance changes by at most half a step.
  const double step_m = move.step.norm() / kStepCount;
  double least_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kStepCount; ++i) {
    const double fraction = static_cast<double>(i) / kStepCount;
    const double distance_m = DistanceToBox(move.At(fraction), box);
    least_m = std::min(least_m, distance_m);
    const bool is_in = span.has_value() && span->from <= fraction && fraction <= span->to;
    if (std::abs(distance_m - limit_m) <= 1e-9) continue;
    EXPECT_EQ(is_in, distance_m < limit_m);
  }
  if (!span.has_value()) return;
  EXPECT_LE(span->distance_m, least_m + 1e-12);
  EXPECT_GE(span->distance_m, least_m - step_m);
  EXPECT_NEAR(DistanceToBox(move.At(span->closest), box), span->distance_m, 1e-12);
  EXPECT_LE(span->from, span->closest);
  EXPECT_LE(span->closest, span->to);
}

TEST(Nearness, OfABoxIsWhatSmallStepsFind) {
  const uint64_t seed = test::TestSeed(51);
  Random random(seed, 0);
  int near_count = 0;
  for (int i = 0; i < 3000; ++i) {
    Move move{.start = RandomPoint(&random, 2.0), .step = RandomPoint(&random, 4.0)};
    // Moves along an axis, and none at all, meet the planes of faces in their own ways.
    for (int axis = 0; axis < 3; ++axis) {
      if (random.Chance(0.2)) move.step[axis] = 0.0;
    }
    const Eigen::Vector3d corner = RandomPoint(&random, 1.0);
    const Box3d box(corner, corner + RandomPoint(&random, 1.0).cwiseAbs());
    SCOPED_TRACE(testing::Message() << "seed " << seed << " case " << i);
    CompareWithSteps(move, box, 0.5);
    near_count += NearBox(move, box, 0.5).has_value() ? 1 : 0;
    if (HasFailure()) return;
  }
  EXPECT_GT(near_count, 200);
  EXPECT_LT(near_count, 2800);
}

TEST(Nearness, OfABoxWithoutSizeIsThatOfAPoint) {
  const uint64_t seed = test::TestSeed(52);
  Random random(seed, 0);
  for (int i = 0; i < 3000; ++i) {
    const Move move{.start = RandomPoint(&random, 2.0), .step = RandomPoint(&random, 4.0)};
    const std::optional<NearSpan> point = NearOrigin(move, 1.0);
    const std::optional<NearSpan> box =
        NearBox(move, Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()), 1.0);
    ASSERT_EQ(point.has_value(), box.has_value()) << "seed " << seed << " case " << i;
    if (!point.has_value()) continue;
    EXPECT_NEAR(point->from, box->from, 1e-9);
    EXPECT_NEAR(point->to, box->to, 1e-9);
    EXPECT_NEAR(point->closest, box->closest, 1e-9);
    EXPECT_NEAR(point->distance_m, box->distance_m, 1e-12);
  }
}

TEST(Nearness, OfAMoveThatJustTouchesHasNoLength) {
  const Move move{.start = {-3.0, 1.0, 0.0}, .step = {6.0, 0.0, 0.0}};
  const std::optional<NearSpan> span = NearOrigin(move, 1.0);
  ASSERT_TRUE(span.has_value());
  EXPECT_DOUBLE_EQ(span->from, 0.5);
  EXPECT_DOUBLE_EQ(span->to, 0.5);
  EXPECT_DOUBLE_EQ(span->distance_m, 1.0);
  EXPECT_FALSE(NearOrigin(move, 1.0 - 1e-6).has_value());
}

TEST(Nearness, OfAMoveThatEndsAtTheLimitIsItsEnd) {
  const Move move{.start = {-3.0, 0.0, 0.0}, .step = {2.0, 0.0, 0.0}, .fraction_slack = 1e-9};
  const std::optional<NearSpan> span = NearOrigin(move, 1.0);
  ASSERT_TRUE(span.has_value());
  EXPECT_DOUBLE_EQ(span->from, 1.0);
  EXPECT_DOUBLE_EQ(span->to, 1.0);
}

TEST(Nearness, OfMovesTooShortToMeasureIsThatOfStandingStill) {
  for (const double length_m : {0.0, 1e-300, 1e-13, 1e-9}) {
    const Move move{.start = {0.5, 0.0, 0.0}, .step = {length_m, 0.0, 0.0}};
    const std::optional<NearSpan> span = NearOrigin(move, 1.0);
    ASSERT_TRUE(span.has_value()) << length_m;
    EXPECT_EQ(span->from, 0.0);
    EXPECT_EQ(span->to, 1.0);
    EXPECT_NEAR(span->distance_m, 0.5, 1e-9);
    EXPECT_FALSE(NearOrigin(move, 0.4).has_value());
  }
}

TEST(Nearness, IsNoneForLimitsThatAreNoNumbers) {
  const Move move{.start = {0.5, 0.0, 0.0}, .step = {1.0, 0.0, 0.0}};
  const Box3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  EXPECT_FALSE(NearOrigin(move, NAN).has_value());
  EXPECT_FALSE(NearBox(move, box, NAN).has_value());
  EXPECT_FALSE(NearBox(move, box, -1.0).has_value());
  EXPECT_TRUE(NearBox(move, box, INFINITY).has_value());
}

}  // namespace
}  // namespace dsg::ingest
