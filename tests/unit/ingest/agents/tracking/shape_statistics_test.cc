// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/shape_statistics.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {
namespace {

constexpr double kNoise = 0.4;

ShapeMean MeanOf(const ShapeVector& shape, int count, Random* random) {
  ShapeMean mean;
  for (int i = 0; i < count; ++i) mean.Add(*ReadShape(NoisyShape(shape, kNoise, random)));
  return mean;
}

TEST(ReadShape, RefusesWhatSaysNothing) {
  EXPECT_FALSE(ReadShape({}).has_value());
  EXPECT_FALSE(ReadShape({1.0f, 2.0f}).has_value());
  EXPECT_FALSE(ReadShape(std::vector<float>(10, 0.0f)).has_value());
  std::vector<float> broken(10, 1.0f);
  broken[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(ReadShape(broken).has_value());
  EXPECT_TRUE(ReadShape(std::vector<float>(10, 0.5f)).has_value());
}

TEST(ShapeStatistics, TellsPersonsApartByOneDetection) {
  constexpr uint64_t kSeed = 7;
  Random random(kSeed, 0);
  const ShapeStatistics statistics(kNoise, 1.0);
  int right = 0;
  constexpr int kCount = 500;
  for (int i = 0; i < kCount; ++i) {
    const ShapeVector shape = DrawShape(&random);
    const ShapeMean known = MeanOf(shape, 10, &random);
    right += statistics.LogRatio(known, MeanOf(shape, 1, &random)) > 3.0;
    right += statistics.LogRatio(known, MeanOf(DrawShape(&random), 1, &random)) < 0.0;
  }
  std::printf("seed %d: %d of %d right\n", static_cast<int>(kSeed), right, 2 * kCount);
  EXPECT_GT(right, 2 * kCount * 97 / 100);
}

TEST(ShapeStatistics, DistanceOfOnePersonIsChiSquared) {
  constexpr uint64_t kSeed = 3;
  Random random(kSeed, 0);
  const ShapeStatistics statistics(kNoise, 1.0);
  double sum = 0.0;
  constexpr int kCount = 2000;
  for (int i = 0; i < kCount; ++i) {
    const ShapeVector shape = DrawShape(&random);
    sum += statistics.SquaredDistance(MeanOf(shape, 5, &random), MeanOf(shape, 1, &random));
  }
  // Slightly below the degrees of freedom: some of the noise is taken to be shared.
  EXPECT_NEAR(sum / kCount, kShapeCount, 1.2) << "seed " << kSeed;
}

TEST(ShapeStatistics, RatioIsSymmetricAndGrowsWithEvidence) {
  Random random(5, 0);
  const ShapeStatistics statistics(kNoise, 1.0);
  const ShapeVector shape = DrawShape(&random);
  ShapeMean a;
  ShapeMean b;
  a.Add(shape);
  b.Add(shape);
  const double single = statistics.LogRatio(a, b);
  EXPECT_DOUBLE_EQ(single, statistics.LogRatio(b, a));
  for (int i = 0; i < 9; ++i) a.Add(shape);
  EXPECT_GT(statistics.LogRatio(a, b), single);
}

TEST(ShapeStatistics, LearnsThatAllPeopleLookAlike) {
  ShapeStatistics statistics(kNoise, 1.0);
  ShapeVector always = ShapeVector::Constant(0.3);
  ShapeMean one;
  one.Add(always);
  const double before = statistics.LogRatio(one, one);
  EXPECT_GT(before, 3.0);
  for (int i = 0; i < 300; ++i) {
    statistics.LearnSpread(one);
  }
  EXPECT_LT(statistics.LogRatio(one, one), 1.0);
}

TEST(ShapeStatistics, LearnsTheNoiseOfTheDetector) {
  constexpr uint64_t kSeed = 11;
  Random random(kSeed, 0);
  ShapeStatistics statistics(0.1, 1.0);
  const ShapeVector shape = DrawShape(&random);
  ShapeMean person;
  for (int i = 0; i < 3000; ++i) {
    const ShapeVector seen = *ReadShape(NoisyShape(shape, 0.5, &random));
    statistics.LearnNoise(person, seen);
    person.Add(seen);
  }
  double sum = 0.0;
  for (int i = 0; i < 300; ++i) {
    ShapeMean seen;
    seen.Add(*ReadShape(NoisyShape(shape, 0.5, &random)));
    sum += statistics.SquaredDistance(person, seen);
  }
  EXPECT_NEAR(sum / 300.0, kShapeCount, 1.5) << "seed " << kSeed;
}

}  // namespace
}  // namespace dsg::ingest
