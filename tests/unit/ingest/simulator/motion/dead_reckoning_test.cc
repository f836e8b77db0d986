// SPDX-License-Identifier: Apache-2.0
// Integrated samples give the motion back, and stray from it by as much as their noise allows.
#include "ingest/simulator/motion/dead_reckoning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/unit/ingest/simulator/motion/motion_test_util.h"

namespace dsg::simulator {
namespace {

struct Stray {
  double position_m = 0.0;
  double rotation_rad = 0.0;
};

// The farthest from the truth that perfect samples lead within 60 s.
Stray StrayOfPerfectSamples(const RobotMotion& motion, double rate_hz) {
  const auto samples = SimulateImu(motion, ImuModel::Perfect(), rate_hz, 1);
  const MotionState start = motion.StateAt(0);
  const auto states = IntegrateImu(samples, {start.map_T_body, start.velocity_map},
                                   Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  Stray stray;
  for (size_t i = 1; i < samples.size(); ++i) {
    const Pose3d& state = states[i].map_T_body;
    const Pose3d truth = motion.StateAt(samples[i].time_ns).map_T_body;
    stray.position_m = std::max(stray.position_m, (state.position - truth.position).norm());
    stray.rotation_rad =
        std::max(stray.rotation_rad, AngleBetween(state.orientation, truth.orientation));
  }
  return stray;
}

TEST(IntegrateImu, GivesTheMotionBackAfterAMinute) {
  double worst_200 = 0.0;
  double worst_2000 = 0.0;
  for (const bool hand_held : {false, true}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " hand held " << hand_held);
      RobotMotionOptions options;
      options.duration_s = 60.0;
      options.still_s = seed % 2 == 0 ? 0.0 : 1.5;
      options.hand_held = hand_held;
      const auto motion = MakeMotion(WorldKind::kApartment, seed, options);
      const Stray at_200 = StrayOfPerfectSamples(*motion, 200.0);
      const Stray at_2000 = StrayOfPerfectSamples(*motion, 2000.0);
      EXPECT_LT(at_200.position_m, 0.01);
      EXPECT_LT(at_2000.position_m, 1e-4);
      EXPECT_LT(at_200.rotation_rad, 1e-4);
      worst_200 = std::max(worst_200, at_200.position_m);
      worst_2000 = std::max(worst_2000, at_2000.position_m);
    }
  }
  RecordProperty("worst_m_at_200_hz", std::to_string(worst_200));
  RecordProperty("worst_m_at_2000_hz", std::to_string(worst_2000));
}

TEST(IntegrateImu, IsExactForConstantForceAndSpin) {
  std::vector<ImuSample> samples;
  const Eigen::Vector3d spin(0.0, 0.0, 0.7);
  for (int i = 0; i <= 100; ++i) {
    ImuSample sample;
    sample.time_ns = i * 10'000'000;
    sample.gyro = spin + Eigen::Vector3d::Constant(0.01);
    sample.accel = Eigen::Vector3d(0.0, 0.0, kGravityM_S2 + 0.5) + Eigen::Vector3d::Constant(0.2);
    samples.push_back(sample);
  }
  NavigationState start;
  start.velocity_map = Eigen::Vector3d(1.0, 2.0, 0.0);
  const NavigationState end =
      IntegrateImu(samples, start, Eigen::Vector3d::Constant(0.01), Eigen::Vector3d::Constant(0.2))
          .back();
  EXPECT_LT((end.map_T_body.position - Eigen::Vector3d(1.0, 2.0, 0.25)).norm(), 1e-9);
  EXPECT_LT((end.velocity_map - Eigen::Vector3d(1.0, 2.0, 0.5)).norm(), 1e-9);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  EXPECT_LT(AngleBetween(end.map_T_body.orientation, turned), 1e-9);
}

TEST(PredictCovariance, OfAUnitAtRestFollowsTheClosedForms) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= 200; ++i) {
    ImuSample sample;
    sample.time_ns = i * 5'000'000;
    sample.accel = Eigen::Vector3d(0.0, 0.0, kGravityM_S2);
    samples.push_back(sample);
  }
  const ImuModel model;
  const Matrix9d covariance = PredictCovariance(samples, {}, model);
  const double sg2 = std::pow(model.gyro_noise_density, 2);
  const double sa2 = std::pow(model.accel_noise_density, 2);
  const double wg2 = std::pow(model.gyro_random_walk, 2);
  const double wa2 = std::pow(model.accel_random_walk, 2);
  const double g2 = kGravityM_S2 * kGravityM_S2;
  // After T = 1 s, upwards: sa^2 T + wa^2 T^3 / 3 and sa^2 T^3 / 3 + wa^2 T^5 / 20.
  EXPECT_NEAR(covariance(0, 0), sg2 + wg2 / 3.0, 0.01 * sg2);
  EXPECT_NEAR(covariance(5, 5), sa2 + wa2 / 3.0, 0.02 * sa2);
  EXPECT_NEAR(covariance(8, 8), sa2 / 3.0 + wa2 / 20.0, 0.02 * sa2);
  // Sideways gravity leaks in through the tilt: g^2 times the integrals of the walk of the angle.
  EXPECT_NEAR(covariance(6, 6), sa2 / 3.0 + wa2 / 20.0 + g2 * (sg2 / 20.0 + wg2 / 252.0),
              0.02 * sa2);
  EXPECT_NEAR((covariance - covariance.transpose()).norm(), 0.0, 1e-15);
}

std::vector<ReckonedWindow> Reckon(uint64_t seed, double noise_factor) {
  RobotMotionOptions options;
  options.duration_s = 600.0;
  options.hand_held = seed % 2 == 0;
  const auto motion = MakeMotion(WorldKind::kApartment, seed, options);
  ImuModel made;
  made.noise_factor = noise_factor;
  const auto samples = SimulateImu(*motion, made, 200.0, seed);
  return ReckonWindows(*motion, samples, ImuModel(), kNsPerSecond);
}

TEST(ReckonWindows, StrayWithinTheirNoiseModelIn95PercentOfSeconds) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const ReckoningShares shares = SharesWithin(Reckon(seed, 1.0));
    EXPECT_EQ(shares.window_count, 600);
    for (const double share : {shares.position, shares.rotation, shares.all}) {
      EXPECT_GE(share, 0.93);
      // A model that is far too careful would not be one either.
      EXPECT_LE(share, 0.98);
    }
    RecordProperty("shares_of_seed_" + std::to_string(seed), std::to_string(shares.position) + " " +
                                                                 std::to_string(shares.rotation) +
                                                                 " " + std::to_string(shares.all));
  }
}

TEST(ReckonWindows, TellANoisierUnitThanTheDataSheets) {
  const ReckoningShares shares = SharesWithin(Reckon(1, 2.0));
  EXPECT_LT(shares.position, 0.75);
  EXPECT_LT(shares.rotation, 0.75);
  EXPECT_LT(shares.all, 0.5);
}

TEST(ReckonWindows, AreNoneInALogShorterThanOne) {
  RobotMotionOptions options;
  options.duration_s = 0.5;
  const auto motion = MakeMotion(WorldKind::kApartment, 1, options);
  const auto samples = SimulateImu(*motion, {}, 200.0, 1);
  const auto windows = ReckonWindows(*motion, samples, {}, kNsPerSecond);
  EXPECT_TRUE(windows.empty());
  EXPECT_EQ(SharesWithin(windows).window_count, 0);
  EXPECT_TRUE(ReckonWindows(*motion, {}, {}, kNsPerSecond).empty());
}

}  // namespace
}  // namespace dsg::simulator
