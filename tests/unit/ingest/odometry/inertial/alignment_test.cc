// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>

#include "schema/base/status.h"
#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

// A unit that rests for a second, turned as `map_R_imu` says, without noise.
std::vector<ImuMeasurement> RestingSamples(const Eigen::Quaterniond& map_R_imu,
                                           const ImuBias& bias) {
  std::vector<ImuMeasurement> samples = SwungSamples(1.0, 200.0);
  for (ImuMeasurement& sample : samples) {
    sample.angular_velocity_rad_s = bias.gyro_rad_s;
    sample.acceleration_m_s2 = map_R_imu.conjugate() * Vector3d(0.0, 0.0, 9.81) + bias.accel_m_s2;
  }
  return samples;
}

Vector3d UpOf(const AlignedState& aligned) {
  return aligned.state.map_T_imu.orientation.conjugate() * Vector3d::UnitZ();
}

void ExpectNotAligned(const std::vector<ImuMeasurement>& samples, const std::string& words) {
  const auto aligned = AlignAtRest(samples, Adis16448(), 0.0, {});
  EXPECT_EQ(aligned.status().code(), absl::StatusCode::kFailedPrecondition) << aligned.status();
  EXPECT_NE(std::string(aligned.status().message()).find(words), std::string::npos)
      << "no \"" << words << "\" in: " << aligned.status();
}

TEST(AlignAtRest, FindsUpAndTheGyrosBias) {
  Random random(test::TestSeed(1), 0);
  const ImuCalibration unit = Adis16448();
  for (int round = 0; round < 20; ++round) {
    const Eigen::Quaterniond map_R_imu = RotationOf(NormalVector(1.0, &random));
    const ImuBias bias{NormalVector(0.03, &random), Vector3d::Zero()};
    ImuBias walked;
    const auto samples = Noisy(RestingSamples(map_R_imu, bias), unit, &random, &walked);
    const auto aligned = AlignAtRest(samples, unit, 0.7, {});
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    const Vector3d up = map_R_imu.conjugate() * Vector3d::UnitZ();
    EXPECT_LT((UpOf(*aligned) - up).norm(), 2e-3) << round;
    EXPECT_LT((aligned->state.bias.gyro_rad_s - bias.gyro_rad_s).norm(), 1e-3) << round;
    EXPECT_EQ(aligned->state.velocity_map, Vector3d::Zero());
    EXPECT_EQ(aligned->state.map_T_imu.position, Vector3d::Zero());
    EXPECT_EQ(aligned->covariance.llt().info(), Eigen::Success);
  }
}

TEST(AlignAtRest, TurnsByTheYawThatItIsGiven) {
  const auto samples = RestingSamples(RotationOf({0.1, -0.2, 0.0}), {});
  const auto straight = AlignAtRest(samples, Adis16448(), 0.0, {});
  const auto turned = AlignAtRest(samples, Adis16448(), 1.2, {});
  ASSERT_TRUE(straight.ok() && turned.ok());
  const Eigen::Quaterniond difference =
      turned->state.map_T_imu.orientation * straight->state.map_T_imu.orientation.conjugate();
  EXPECT_LT((RotationVectorOf(difference) - Vector3d(0.0, 0.0, 1.2)).norm(), 1e-12);
  // The shortest turn upright has no share about the vertical.
  EXPECT_NEAR(RotationVectorOf(straight->state.map_T_imu.orientation).z(), 0.0, 1e-12);
}

TEST(AlignAtRest, StandsOnItsHeadToo) {
  const auto samples = RestingSamples(RotationOf({M_PI, 0.0, 0.0}), {});
  const auto aligned = AlignAtRest(samples, Adis16448(), 0.0, {});
  ASSERT_TRUE(aligned.ok()) << aligned.status();
  EXPECT_LT((UpOf(*aligned) + Vector3d::UnitZ()).norm(), 1e-6);
}

// Tilt and bias that were drawn stray by as much as the covariance says, and together.
TEST(AlignAtRest, CovarianceHoldsWhatABiasTilts) {
  Random random(test::TestSeed(2), 0);
  const ImuCalibration unit = Adis16448();
  // Small, so that first order holds.
  InertialOptions options;
  options.rest_accel_bias_sigma = 0.03;
  double sum = 0.0;
  const int run_count = 500;
  for (int run = 0; run < run_count; ++run) {
    const Eigen::Quaterniond map_R_imu = RotationOf(NormalVector(1.0, &random));
    const ImuBias bias{NormalVector(0.02, &random),
                       NormalVector(options.rest_accel_bias_sigma, &random)};
    ImuBias walked;
    ImuCalibration white = unit;
    white.gyro_random_walk = 1e-12;
    white.accel_random_walk = 1e-12;
    const auto samples = Noisy(RestingSamples(map_R_imu, bias), white, &random, &walked);
    const auto aligned = AlignAtRest(samples, white, 0.0, options);
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    // Yaw is free: the truth is turned to the state's.
    const Eigen::Quaterniond off = aligned->state.map_T_imu.orientation * map_R_imu.conjugate();
    const double yaw = 2.0 * std::atan2(off.z(), off.w());
    InertialState truth;
    truth.map_T_imu.orientation = RotationOf({0.0, 0.0, yaw}) * map_R_imu;
    truth.bias = bias;
    const Vector15d error = StepBetween(aligned->state, truth);
    sum += error.dot(aligned->covariance.llt().solve(error));
  }
  // Two of tilt and six of biases.
  EXPECT_NEAR(sum / run_count / 8.0, 1.0, 0.12);
}

TEST(AlignAtRest, RefusesMotion) {
  ExpectNotAligned(SwungSamples(1.0, 200.0), "it moves");
  auto samples = RestingSamples(Eigen::Quaterniond::Identity(), {});
  for (size_t i = 0; i < samples.size(); ++i) {
    samples[i].angular_velocity_rad_s.y() = 0.05 * std::sin(0.1 * static_cast<double>(i));
  }
  ExpectNotAligned(samples, "it turns: its rate varies");
  for (ImuMeasurement& sample : samples) sample.angular_velocity_rad_s = Vector3d(0.0, 0.0, 0.3);
  ExpectNotAligned(samples, "all the time");
}

TEST(AlignAtRest, RefusesWhatIsNoGravity) {
  const auto resting = RestingSamples(Eigen::Quaterniond::Identity(), {});
  for (const auto& [share, words] : {std::pair(1.0 / 9.80665, "look like g"),
                                     std::pair(0.0, "subtracted"), std::pair(1.5, "scale")}) {
    auto samples = resting;
    for (ImuMeasurement& sample : samples) sample.acceleration_m_s2 *= share;
    ExpectNotAligned(samples, words);
  }
}

TEST(AlignAtRest, WaitsForEnoughSamples) {
  auto samples = RestingSamples(Eigen::Quaterniond::Identity(), {});
  ExpectNotAligned({}, "wait for more");
  ExpectNotAligned({samples.begin(), samples.begin() + 100}, "wait for more");
  samples.pop_back();
  EXPECT_TRUE(AlignAtRest(samples, Adis16448(), 0.0, {}).ok());
}

TEST(AlignAtRest, RefusesFlawedSamples) {
  auto samples = RestingSamples(Eigen::Quaterniond::Identity(), {});
  samples[50].acceleration_m_s2.z() = std::nan("");
  EXPECT_EQ(ReasonOf(AlignAtRest(samples, Adis16448(), 0.0, {}).status()), Reason::kFieldInvalid);
  samples = RestingSamples(Eigen::Quaterniond::Identity(), {});
  samples.erase(samples.begin() + 50, samples.begin() + 70);
  EXPECT_EQ(ReasonOf(AlignAtRest(samples, Adis16448(), 0.0, {}).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
