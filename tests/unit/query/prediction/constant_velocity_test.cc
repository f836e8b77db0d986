// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "query/prediction/velocity.h"
#include "tests/unit/query/prediction/path_points.h"

namespace dsg::query {
namespace {

TEST(Velocity, OfNobodyIsNotKnown) {
  EXPECT_EQ(LastVelocity({}).step_count, 0);
  EXPECT_EQ(LastVelocity({At(1, 2, 3)}).step_count, 0);
  EXPECT_EQ(SmoothedVelocity({At(1, 2, 3)}, 0.4).velocity_map, Eigen::Vector3d::Zero());
}

TEST(Velocity, OfTheLastStepForgetsTheOthers) {
  const Velocity velocity = LastVelocity({At(0, 0, 0), At(1, 5, 0), At(1.5, 5, 1)});
  EXPECT_EQ(velocity.step_count, 1);
  EXPECT_NEAR((velocity.velocity_map - Eigen::Vector3d(0, 2, 0)).norm(), 0.0, 1e-12);
}

TEST(Velocity, WeighsAStepByItsAge) {
  const Velocity velocity = SmoothedVelocity({At(0, 0, 0), At(1, 1, 0), At(2, 3, 0)}, 0.5);
  EXPECT_EQ(velocity.step_count, 2);
  EXPECT_NEAR(velocity.velocity_map.x(), (2.0 + 0.5 * 1.0) / 1.5, 1e-12);
}

TEST(Velocity, IsThatOfSteadyWalkersWhateverTheirStamps) {
  const std::vector<PathPoint> path = {At(0, 0, 0), At(0.1, 0.13, 0), At(1.7, 2.21, 0),
                                       At(2.0, 2.6, 0)};
  for (const double decay : {0.0, 0.3, 1.0}) {
    EXPECT_NEAR(SmoothedVelocity(path, decay).velocity_map.x(), 1.3, 1e-12) << decay;
  }
}

TEST(Velocity, LooksBackSevenSteps) {
  std::vector<PathPoint> path = {At(0, -100, 0)};
  for (int i = 1; i <= 8; ++i) path.push_back(At(i, i, 0));
  EXPECT_EQ(SmoothedVelocity(path, 1.0).step_count, 7);
  EXPECT_NEAR(SmoothedVelocity(path, 1.0).velocity_map.x(), 1.0, 1e-12);
}

TEST(Velocity, TakesTheLastOfTwoPointsOfOneTime) {
  const Velocity velocity = LastVelocity({At(0, 0, 0), At(1, 9, 9), At(1, 2, 0)});
  EXPECT_EQ(velocity.step_count, 1);
  EXPECT_NEAR(velocity.velocity_map.x(), 2.0, 1e-12);
  EXPECT_EQ(LastVelocity({At(1, 0, 0), At(1, 1, 0)}).step_count, 0);
}

TEST(ConstantVelocity, GoesStraightAndGrowsLessSure) {
  const PredictedPath path =
      PredictConstantVelocity({At(0, 0, 0), At(1, 1, 1)}, {kSecond, 3 * kSecond}, {});
  EXPECT_EQ(path.probability, 1.0);
  ASSERT_EQ(path.positions_map.size(), 2u);
  EXPECT_EQ(path.positions_map[0], Eigen::Vector3d(1, 1, 0.9));
  EXPECT_NEAR((path.positions_map[1] - Eigen::Vector3d(3, 3, 0.9)).norm(), 0.0, 1e-12);
  EXPECT_EQ(path.sigma_m[0], 0.0);
  EXPECT_NEAR(path.sigma_m[1], 0.5, 1e-12);
}

TEST(ConstantVelocity, LeavesALonelyPointWhereItIs) {
  const PredictedPath path = PredictConstantVelocity({At(0, 4, 5)}, {100 * kSecond}, {});
  EXPECT_EQ(path.positions_map[0], Eigen::Vector3d(4, 5, 0.9));
  EXPECT_TRUE(PredictConstantVelocity({At(0, 4, 5)}, {}, {}).positions_map.empty());
}

TEST(ConstantVelocity, DampsAsTheSumOfManySmallSteps) {
  ConstantVelocityOptions options;
  options.damping = 0.5;
  const std::vector<PathPoint> path = {At(0, -1, 0), At(1, 0, 0)};
  const double predicted =
      PredictConstantVelocity(path, {4 * kSecond}, options).positions_map[0].x();
  double summed = 0.0;
  for (int i = 0; i < 30000; ++i) summed += std::pow(0.5, (i + 0.5) * 1e-4) * 1e-4;
  EXPECT_NEAR(predicted, summed, 1e-6);
  options.damping = 0.0;
  EXPECT_EQ(PredictConstantVelocity(path, {4 * kSecond}, options).positions_map[0].x(), 0.0);
}

TEST(WeightedVelocity, SmoothsThoseWhoZigzagAndTrustsThoseWhoTurn) {
  std::vector<PathPoint> noisy;
  std::vector<PathPoint> turning;
  for (int i = 0; i < 8; ++i) {
    noisy.push_back(At(0.4 * i, 0.4 * i, i % 2 == 0 ? 0.1 : -0.1));
    turning.push_back(At(0.4 * i, 3.0 * std::sin(0.15 * i), 3.0 - 3.0 * std::cos(0.15 * i)));
  }
  const std::vector<TimeNs> at_ns = {At(0.4 * 8, 0, 0).time_ns};
  const auto error_m = [&](const std::vector<PathPoint>& path, const Eigen::Vector3d& truth_map,
                           const PredictedPath& predicted) {
    EXPECT_EQ(predicted.positions_map.size(), 1u) << path.size();
    return (predicted.positions_map[0] - truth_map).norm();
  };
  const Eigen::Vector3d straight(3.2, 0, 0.9);
  EXPECT_LT(error_m(noisy, straight, PredictWeightedVelocity(noisy, at_ns, {})),
            0.8 * error_m(noisy, straight, PredictConstantVelocity(noisy, at_ns, {})));
  const Eigen::Vector3d on(3.0 * std::sin(1.2), 3.0 - 3.0 * std::cos(1.2), 0.9);
  EXPECT_LT(error_m(turning, on, PredictWeightedVelocity(turning, at_ns, {})), 0.1);
}

TEST(WeightedVelocity, LeavesALonelyPointWhereItIs) {
  const PredictedPath path = PredictWeightedVelocity({At(0, 4, 5)}, {100 * kSecond}, {});
  EXPECT_EQ(path.positions_map[0], Eigen::Vector3d(4, 5, 0.9));
}

TEST(PredictionDeathTest, RefusesWhatIsNotANumberOrGoesBack) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(LastVelocity({At(0, 0, 0), At(1, nan, 0)}), "allFinite");
  EXPECT_DEATH(LastVelocity({At(1, 0, 0), At(0, 0, 0)}), "time_ns");
  EXPECT_DEATH(SmoothedVelocity({At(0, 0, 0)}, nan), "decay");
  EXPECT_DEATH(SmoothedVelocity({At(0, 0, 0)}, 1.5), "decay");
  EXPECT_DEATH(PredictConstantVelocity({}, {}, {}), "empty");
  EXPECT_DEATH(PredictConstantVelocity({At(2, 0, 0)}, {kSecond}, {}), "before_ns");
}

}  // namespace
}  // namespace dsg::query
