// SPDX-License-Identifier: Apache-2.0
// Adaptive voting and the rotation by graduated non-convexity, each on its own.
#include <gtest/gtest.h>

#include "schema/matching/robust_estimators.h"
#include "tests/unit/schema/matching/registration_test_util.h"

namespace dsg {
namespace {

double TruncatedCost(const std::vector<Measurement>& measurements, double value) {
  double cost = 0.0;
  for (const Measurement& m : measurements) {
    const double miss = (m.value - value) / m.bound;
    cost += std::min(miss * miss, 1.0);
  }
  return cost;
}

TEST(AdaptiveVoting, FindsTheCheapestValueThereIs) {
  Random random(21, 0);
  for (int round = 0; round < 300; ++round) {
    std::vector<Measurement> measurements;
    const int count = 1 + random.Index(20);
    for (int i = 0; i < count; ++i) {
      const double value = random.Uniform(-1.0, 1.0);
      measurements.push_back({value, random.Uniform(0.05, 0.5)});
    }
    const Vote vote = VoteAdaptively(measurements);
    EXPECT_NEAR(vote.cost, TruncatedCost(measurements, vote.value), 1e-9);
    for (double value = -1.5; value <= 1.5; value += 0.01) {
      ASSERT_LE(vote.cost, TruncatedCost(measurements, value) + 1e-9)
          << "seed 21, round " << round << ", at " << value;
    }
  }
}

TEST(AdaptiveVoting, IsNotMovedByFarValuesHoweverLarge) {
  std::vector<Measurement> measurements = {{5.0, 0.1}, {5.02, 0.1}, {4.98, 0.1}};
  for (int i = 0; i < 50; ++i) measurements.push_back({1e6 * (i - 20) + 17.0, 0.1});
  EXPECT_NEAR(VoteAdaptively(measurements).value, 5.0, 1e-6);
}

TEST(AdaptiveVoting, OfNothingIsZero) { EXPECT_EQ(VoteAdaptively({}).value, 0.0); }

Columns RandomVectors(int count, Random* random) {
  Columns vectors(3, count);
  for (int i = 0; i < count; ++i) vectors.col(i) = RandomNormal(random, 1.0);
  return vectors;
}

TEST(GncRotation, IgnoresSixtyPerCentWrongVectors) {
  Random random(22, 0);
  for (const bool is_upright : {false, true}) {
    for (int round = 0; round < 50; ++round) {
      const Eigen::Matrix3d truth =
          is_upright ? Yaw(random.Uniform(-3.0, 3.0)) : RandomRotation(&random);
      const Columns a = RandomVectors(50, &random);
      Columns b = truth * a;
      for (int i = 0; i < 30; ++i) b.col(i) = RandomNormal(&random, 1.0);
      const GncRotation found = RotateRobustly(a, b, {.bound = 0.05, .is_upright = is_upright});
      EXPECT_LT((found.rotation - truth).norm(), 0.02) << "seed 22, round " << round;
      EXPECT_GE(found.weights.tail(20).minCoeff(), 0.99);
    }
  }
}

TEST(GncRotation, NeverReflects) {
  Random random(23, 0);
  const Columns a = RandomVectors(20, &random);
  const Columns b = Eigen::Vector3d(-1.0, 1.0, 1.0).asDiagonal() * a;
  for (const bool is_upright : {false, true}) {
    const GncRotation found = RotateRobustly(a, b, {.bound = 0.05, .is_upright = is_upright});
    EXPECT_NEAR(found.rotation.determinant(), 1.0, 1e-9);
  }
}

TEST(GncRotation, TurnsAboutZOnlyWhenUpright) {
  Random random(24, 0);
  const Columns a = RandomVectors(20, &random);
  const Columns b = RandomRotation(&random) * a;
  const GncRotation found = RotateRobustly(a, b, {.bound = 0.05, .is_upright = true});
  EXPECT_EQ(found.rotation.col(2), Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
}

}  // namespace
}  // namespace dsg
