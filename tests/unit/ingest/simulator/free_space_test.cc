// SPDX-License-Identifier: Apache-2.0
// Exact distances against dense sampling and by hand.
#include "ingest/simulator/world/free_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

TEST(FreeSpace, MeasuresKnownDistances) {
  const Rect rect(Point(1, 1), Point(3, 2));
  EXPECT_DOUBLE_EQ(DistanceToRect(Point(2, 1.5), rect), 0.0);
  EXPECT_DOUBLE_EQ(DistanceToRect(Point(0, 0), rect), std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(SegmentDistanceToRect(Point(0, 0), Point(4, 0), rect), 1.0);
  EXPECT_DOUBLE_EQ(SegmentDistanceToRect(Point(0, 1.5), Point(4, 1.5), rect), 0.0);
  // Past a corner, where neither end is nearest.
  EXPECT_NEAR(SegmentDistanceToRect(Point(0, 1), Point(1, 0), rect), std::sqrt(0.5), 1e-12);
  EXPECT_DOUBLE_EQ(SegmentDistanceToRect(Point(0, 0), Point(0, 0), rect), std::sqrt(2.0));
}

TEST(FreeSpace, SegmentClearanceEqualsDenseSampling) {
  const uint64_t seed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  const auto draw = [&] { return Point(random.Uniform(0, 10), random.Uniform(0, 10)); };
  for (int round = 0; round < 300; ++round) {
    FreeSpace space;
    for (int i = 0; i < 4; ++i) {
      const Point low = draw();
      space.Add(Rect(low, low + Point(random.Uniform(0.1, 2), random.Uniform(0.1, 2))));
    }
    const Point from = draw();
    const Point to = draw();
    double sampled = 1e9;
    constexpr int kSamples = 2000;
    for (int i = 0; i <= kSamples; ++i) {
      const double t = static_cast<double>(i) / kSamples;
      sampled = std::min(sampled, space.Clearance(from + t * (to - from)));
    }
    const double exact = space.SegmentClearance(from, to);
    EXPECT_LE(exact, sampled + 1e-12);
    EXPECT_GE(exact, sampled - (to - from).norm() / kSamples);
    const double radius = random.Uniform(0.05, 3.0);
    EXPECT_EQ(space.SegmentKeepsClear(from, to, radius), exact >= radius);
  }
}

// What was given at once is found through the index, what was added later is gone through.
TEST(FreeSpace, AnswersTheSameWithAndWithoutItsIndex) {
  const uint64_t seed = 8;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  // Far outside of the obstacles too.
  const auto draw = [&] { return Point(random.Uniform(-20, 60), random.Uniform(-20, 60)); };
  for (const int count : {0, 1, 3, 200}) {
    std::vector<Rect> obstacles;
    FreeSpace plain;
    for (int i = 0; i < count; ++i) {
      const Point low(random.Uniform(0, 40), random.Uniform(0, 30));
      obstacles.push_back(Rect(low, low + Point(random.Uniform(0.1, 9), random.Uniform(0.1, 2))));
      plain.Add(obstacles.back());
    }
    FreeSpace indexed(obstacles);
    for (int round = 0; round < 500; ++round) {
      const Point from = draw();
      const Point to = round % 2 == 0 ? draw() : Point(from + 0.05 * draw());
      EXPECT_EQ(indexed.Clearance(from), plain.Clearance(from));
      EXPECT_EQ(indexed.SegmentClearance(from, to), plain.SegmentClearance(from, to));
      const double radius = random.Uniform(0.05, 3.0);
      EXPECT_EQ(indexed.SegmentKeepsClear(from, to, radius),
                plain.SegmentKeepsClear(from, to, radius));
    }
    const Rect late(Point(50, 50), Point(51, 51));
    indexed.Add(late);
    EXPECT_EQ(indexed.Clearance(Point(50.5, 50.5)), 0.0);
  }
}

}  // namespace
}  // namespace dsg::simulator
