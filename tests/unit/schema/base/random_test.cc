// SPDX-License-Identifier: Apache-2.0
// The streams are what they were on the day they were written, and are distributed as they claim.
#include "schema/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace dsg {
namespace {

TEST(Random, RepeatsItselfAndSeparatesStreams) {
  Random a(5, 1);
  Random b(5, 1);
  Random other_stream(5, 2);
  Random other_seed(6, 1);
  std::set<double> values;
  for (int i = 0; i < 100; ++i) {
    const double value = a.Uniform();
    EXPECT_EQ(value, b.Uniform());
    values.insert({value, other_stream.Uniform(), other_seed.Uniform()});
  }
  EXPECT_EQ(values.size(), 300u);
}

TEST(Random, StaysWithinItsBounds) {
  Random random(1, 0);
  std::set<int> seen;
  for (int i = 0; i < 10'000; ++i) {
    const double value = random.Uniform(-2.0, 3.0);
    EXPECT_GE(value, -2.0);
    EXPECT_LT(value, 3.0);
    seen.insert(random.Integer(4, 7));
    EXPECT_GE(random.Exponential(), 0.0);
  }
  EXPECT_EQ(seen, (std::set<int>{4, 5, 6, 7}));
}

TEST(Random, NormalHasUnitDeviationAndThinTails) {
  Random random(2, 0);
  constexpr int kCount = 200'000;
  double sum = 0.0;
  double sum_squares = 0.0;
  int beyond_two = 0;
  for (int i = 0; i < kCount; ++i) {
    const double value = random.Normal();
    sum += value;
    sum_squares += value * value;
    if (std::abs(value) > 2.0) ++beyond_two;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.01);
  EXPECT_NEAR(sum_squares / kCount, 1.0, 0.02);
  EXPECT_NEAR(static_cast<double>(beyond_two) / kCount, 0.0455, 0.003);
}

TEST(Random, ExponentialHasUnitMean) {
  Random random(3, 0);
  double sum = 0.0;
  for (int i = 0; i < 100'000; ++i) sum += random.Exponential();
  EXPECT_NEAR(sum / 100'000, 1.0, 0.02);
}

}  // namespace
}  // namespace dsg
