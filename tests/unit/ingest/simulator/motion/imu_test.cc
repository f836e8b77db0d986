// SPDX-License-Identifier: Apache-2.0
// Inertial samples are the motion's derivatives plus noise of the stated size.
#include "ingest/simulator/motion/imu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/ingest/simulator/motion/motion_test_util.h"

namespace dsg::simulator {
namespace {

// Stands, or speeds up along body x, or spins: whatever the state says.
class FixedMotion : public RobotMotion {
 public:
  FixedMotion(const MotionState& state, double duration_s)
      : state_(state), duration_ns_(std::llround(duration_s * 1e9)) {}
  TimeNs duration_ns() const override { return duration_ns_; }
  MotionState StateAt(TimeNs) const override { return state_; }
  int rooms_visited() const override { return 0; }

 private:
  MotionState state_;
  TimeNs duration_ns_;
};

TEST(SimulateImu, StampsAreMultiplesOfThePeriodFromZeroToTheEnd) {
  const FixedMotion motion(MotionState(), 2.0);
  const auto samples = SimulateImu(motion, {}, 200.0, 1);
  ASSERT_EQ(samples.size(), 401u);
  for (size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].time_ns, static_cast<TimeNs>(i) * 5'000'000);
  }
}

TEST(SimulateImu, FeelsGravityAndAccelerationInTheBodysAxes) {
  MotionState state;
  // Turned left by a quarter, then accelerating along map x: to the body's right.
  state.map_T_body.orientation =
      Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ());
  state.acceleration_map = Eigen::Vector3d(1.5, 0.0, 0.0);
  state.angular_velocity_body = Eigen::Vector3d(0.1, -0.2, 0.3);
  const auto samples = SimulateImu(FixedMotion(state, 0.1), ImuModel::Perfect(), 200.0, 1);
  for (const ImuSample& sample : samples) {
    EXPECT_LT((sample.accel - Eigen::Vector3d(0.0, -1.5, 9.81)).norm(), 1e-12);
    EXPECT_EQ(sample.gyro, state.angular_velocity_body);
    EXPECT_EQ(sample.gyro_bias, Eigen::Vector3d::Zero());
  }
}

TEST(SimulateImu, NoiseHasTheDensityOfTheDataSheet) {
  const FixedMotion motion(MotionState(), 300.0);
  for (const double factor : {1.0, 2.0}) {
    ImuModel model;
    model.noise_factor = factor;
    const auto samples = SimulateImu(motion, model, 200.0, 3);
    Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
    Eigen::Vector3d accel = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : samples) {
      gyro += (sample.gyro - sample.gyro_bias).cwiseAbs2();
      accel += (sample.accel - sample.accel_bias - Eigen::Vector3d(0, 0, 9.81)).cwiseAbs2();
    }
    const auto count = static_cast<double>(samples.size());
    for (int axis = 0; axis < 3; ++axis) {
      // Design value at 200 Hz: 2.4e-3 rad/s and 2.8e-2 m/s^2.
      EXPECT_NEAR(std::sqrt(gyro[axis] / count), factor * 2.4e-3, factor * 3e-5);
      EXPECT_NEAR(std::sqrt(accel[axis] / count), factor * 2.828e-2, factor * 3e-4);
    }
  }
}

TEST(SimulateImu, BiasesStartAndWalkAsStated) {
  const FixedMotion motion(MotionState(), 30.0);
  const ImuModel model;
  double start = 0.0;
  double gyro_walk = 0.0;
  double accel_walk = 0.0;
  const int seed_count = 200;
  for (uint64_t seed = 0; seed < seed_count; ++seed) {
    const auto samples = SimulateImu(motion, model, 50.0, seed);
    const ImuSample& first = samples.front();
    const ImuSample& last = samples.back();
    start += first.accel_bias.squaredNorm();
    gyro_walk += (last.gyro_bias - first.gyro_bias).squaredNorm();
    accel_walk += (last.accel_bias - first.accel_bias).squaredNorm();
  }
  const double count = 3.0 * seed_count;
  EXPECT_NEAR(std::sqrt(start / count), 0.05, 0.004);
  EXPECT_NEAR(std::sqrt(gyro_walk / count), 1.9393e-5 * std::sqrt(30.0), 1e-5);
  EXPECT_NEAR(std::sqrt(accel_walk / count), 3e-3 * std::sqrt(30.0), 1.4e-3);
}

TEST(SimulateImu, CutsReadingsAtTheUnitsRange) {
  MotionState state;
  state.acceleration_map = Eigen::Vector3d(500.0, -500.0, 0.0);
  state.angular_velocity_body = Eigen::Vector3d(-20.0, 0.0, 20.0);
  const auto samples = SimulateImu(FixedMotion(state, 0.1), ImuModel::Perfect(), 200.0, 1);
  EXPECT_EQ(samples[0].accel, Eigen::Vector3d(177.0, -177.0, 9.81));
  EXPECT_EQ(samples[0].gyro, Eigen::Vector3d(-17.5, 0.0, 17.5));
}

TEST(SimulateImu, MisalignmentScalesWhatIsMeasured) {
  MotionState state;
  ImuModel model = ImuModel::Perfect();
  model.misalignment = 1e-3;
  const auto samples = SimulateImu(FixedMotion(state, 0.1), model, 200.0, 4);
  const Eigen::Vector3d error = samples[0].accel - Eigen::Vector3d(0, 0, 9.81);
  EXPECT_GT(error.norm(), 1e-3);
  EXPECT_LT(error.norm(), 6e-2);
  EXPECT_EQ(samples[0].accel, samples[5].accel);
}

TEST(SimulateImu, SameSeedSameSamples) {
  RobotMotionOptions options;
  options.duration_s = 5.0;
  const auto motion = MakeMotion(WorldKind::kApartment, 1, options);
  const auto a = SimulateImu(*motion, {}, 200.0, 9);
  const auto b = SimulateImu(*motion, {}, 200.0, 9);
  const auto c = SimulateImu(*motion, {}, 200.0, 10);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].gyro, b[i].gyro);
    EXPECT_EQ(a[i].accel, b[i].accel);
  }
  EXPECT_NE(a[7].gyro, c[7].gyro);
}

}  // namespace
}  // namespace dsg::simulator
