// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/moving_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>

#include "ingest/odometry/inertial/path_fit.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"
#include "tests/unit/ingest/odometry/inertial/made_motion.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

constexpr double kToDegrees = 180.0 / M_PI;

absl::StatusOr<AlignedPath> AlignWindow(MadeWindow* window, double yaw_rad = 0.0,
                                        const InertialOptions& options = {}) {
  return AlignInMotion(window->start_T_imu, window->Between(), Adis16448(), yaw_rad, options);
}

struct StartErrors {
  double tilt_deg = 0.0;
  double speed_m_s = 0.0;
  double gyro_rad_s = 0.0;
  double accel_m_s2 = 0.0;
};

// Yaw and position are free, so directions and velocities are compared in the unit's frame.
StartErrors ErrorsOf(const InertialState& state, const InertialState& truth) {
  const auto up_of = [](const InertialState& of) -> Vector3d {
    return of.map_T_imu.orientation.conjugate() * Vector3d::UnitZ();
  };
  const Vector3d speed = state.map_T_imu.orientation.conjugate() * state.velocity_map -
                         truth.map_T_imu.orientation.conjugate() * truth.velocity_map;
  return {kToDegrees * std::acos(std::min(1.0, up_of(state).dot(up_of(truth)))), speed.norm(),
          (state.bias.gyro_rad_s - truth.bias.gyro_rad_s).norm(),
          (state.bias.accel_m_s2 - truth.bias.accel_m_s2).norm()};
}

void ExpectNotStarted(MadeWindow* window, const std::string& words) {
  ASSERT_TRUE(Integrate(window));
  const auto aligned = AlignWindow(window);
  EXPECT_EQ(aligned.status().code(), absl::StatusCode::kFailedPrecondition) << aligned.status();
  EXPECT_NE(std::string(aligned.status().message()).find(words), std::string::npos)
      << "no \"" << words << "\" in: " << aligned.status();
  EXPECT_EQ(std::string(aligned.status().message()).substr(0, 6), "imu0: ");
}

TEST(AlignInMotion, FindsUpSpeedAndBiases) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(test::TestSeed(seed), 0);
    const MadeMotion motion = CarriedMotion(&random);
    const ImuBias bias = {NormalVector(0.05, &random), NormalVector(0.05, &random)};
    MadeWindow window = MakeWindow(motion, random.Uniform(0.0, 10.0), 11, bias, {}, &random);
    ASSERT_TRUE(Integrate(&window));
    const auto aligned = AlignWindow(&window);
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    ASSERT_EQ(aligned->states.size(), 11u);
    const StartErrors errors = ErrorsOf(aligned->last.state, window.truth.back());
    EXPECT_LT(errors.tilt_deg, 1.0);
    EXPECT_LT(errors.speed_m_s, 0.05);
    EXPECT_LT(errors.gyro_rad_s, 0.006);
    EXPECT_LT(errors.accel_m_s2, 0.16);
    EXPECT_NEAR(aligned->free_gravity_m_s2, 9.81, 0.15);
    const std::string name = "seed_" + std::to_string(seed);
    RecordProperty(name + "_tilt_deg", std::to_string(errors.tilt_deg));
    RecordProperty(name + "_speed_m_s", std::to_string(errors.speed_m_s));
    RecordProperty(name + "_gyro_rad_s", std::to_string(errors.gyro_rad_s));
    RecordProperty(name + "_accel_m_s2", std::to_string(errors.accel_m_s2));
    for (size_t i = 0; i < window.truth.size(); ++i) {
      EXPECT_LT(ErrorsOf(aligned->states[i], window.truth[i]).speed_m_s, 0.06) << i;
    }
  }
}

TEST(AlignInMotion, IsExactWithoutNoise) {
  Random random(test::TestSeed(3), 0);
  const MadeMotion motion = CarriedMotion(&random);
  const ImuBias bias = {{0.1, -0.1, 0.12}, Vector3d::Zero()};
  MadeWindow window;
  for (int i = 0; i <= 400; ++i) {
    window.samples.push_back(motion.SampleAt(0.005 * i));
    window.samples.back().angular_velocity_rad_s += bias.gyro_rad_s;
  }
  for (int i = 0; i <= 10; ++i) {
    window.truth.push_back({motion.PoseAt(0.2 * i), motion.VelocityAt(0.2 * i), bias});
  }
  window.start_T_imu = SeenPoses(window.truth, {0.0, 0.0}, &random);
  ASSERT_TRUE(Integrate(&window));
  const auto aligned = AlignWindow(&window);
  ASSERT_TRUE(aligned.ok()) << aligned.status();
  for (size_t i = 0; i < window.truth.size(); ++i) {
    const StartErrors errors = ErrorsOf(aligned->states[i], window.truth[i]);
    // What is left is of rates and forces taken as straight between samples.
    EXPECT_LT(errors.tilt_deg, 0.002) << i;
    EXPECT_LT(errors.speed_m_s, 2e-4) << i;
    EXPECT_LT(errors.gyro_rad_s, 1e-5) << i;
    EXPECT_LT(errors.accel_m_s2, 5e-4) << i;
  }
  // The integrations follow the bias.
  for (const Preintegration& part : window.parts) {
    EXPECT_LT((part.bias().gyro_rad_s - bias.gyro_rad_s).norm(), 0.0101);
    EXPECT_EQ(part.bias().accel_m_s2, Vector3d::Zero());
  }
}

TEST(AlignInMotion, PutsTheLastKeyframeAtTheOriginWithTheYaw) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = MakeWindow(CarriedMotion(&random), 0.0, 11, {}, {}, &random);
  ASSERT_TRUE(Integrate(&window));
  const auto straight = AlignWindow(&window);
  const auto turned = AlignWindow(&window, 1.2);
  ASSERT_TRUE(straight.ok() && turned.ok());
  const Pose3d last = straight->states.back().map_T_imu;
  EXPECT_LT(last.position.norm(), 1e-12);
  EXPECT_NEAR(RotationVectorOf(last.orientation).z(), 0.0, 1e-9);
  for (size_t i = 0; i < straight->states.size(); ++i) {
    const InertialState& from = straight->states[i];
    const InertialState& to = turned->states[i];
    const Eigen::Quaterniond turn = RotationOf({0.0, 0.0, 1.2});
    EXPECT_LT((to.map_T_imu.position - turn * from.map_T_imu.position).norm(), 1e-9);
    EXPECT_LT((to.velocity_map - turn * from.velocity_map).norm(), 1e-9);
    EXPECT_LT(AngleBetween(to.map_T_imu.orientation, turn * from.map_T_imu.orientation), 1e-7);
  }
  EXPECT_EQ(StepBetween(straight->last.state, straight->states.back()).norm(), 0.0);
}

// Gravity is felt at rest and at any constant speed; a bias of the accelerometer is taken for a
// tilt there, and the covariance says so.
TEST(AlignInMotion, TakesStandingStillAndConstantSpeed) {
  for (const double speed : {0.0, 1.5}) {
    SCOPED_TRACE(testing::Message() << speed << " m/s");
    Random random(test::TestSeed(2), 0);
    MadeMotion motion;
    motion.speed_m_s = speed * Vector3d(0.6, -0.8, 0.0);
    motion.map_R_first = RotationOf({0.3, -0.4, 1.0});
    const ImuBias bias = {{0.02, 0.03, -0.01}, {0.05, -0.05, 0.05}};
    MadeWindow window = MakeWindow(motion, 0.0, 11, bias, {}, &random);
    ASSERT_TRUE(Integrate(&window));
    const auto aligned = AlignWindow(&window);
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    const StartErrors errors = ErrorsOf(aligned->last.state, window.truth.back());
    EXPECT_LT(errors.tilt_deg, 0.8);
    EXPECT_LT(errors.speed_m_s, 0.05);
    EXPECT_LT(errors.gyro_rad_s, 0.006);
    const auto tilt = aligned->last.covariance.block<3, 3>(kRotationRow, kRotationRow);
    EXPECT_GT(std::sqrt(0.5 * tilt.trace()), 0.1 / 9.81);
    EXPECT_LT(std::sqrt(0.5 * tilt.trace()), 0.13 / 9.81);
  }
}

TEST(AlignInMotion, TellsBiasFromTiltByTurning) {
  Random random(test::TestSeed(2), 0);
  MadeMotion motion = CarriedMotion(&random);
  motion.swing_rad = 1.0;
  const ImuBias bias = {Vector3d::Zero(), {0.15, -0.15, 0.15}};
  MadeWindow window = MakeWindow(motion, 0.0, 21, bias, {}, &random);
  ASSERT_TRUE(Integrate(&window));
  InertialOptions options;
  options.start.way_sigma_m = 0.004;
  options.start.turn_sigma_rad = 0.0025;
  const auto aligned = AlignWindow(&window, 0.0, options);
  ASSERT_TRUE(aligned.ok()) << aligned.status();
  EXPECT_LT(ErrorsOf(aligned->last.state, window.truth.back()).accel_m_s2, 0.06);
  EXPECT_LT(ErrorsOf(aligned->last.state, window.truth.back()).tilt_deg, 0.4);
  const auto sigma = aligned->last.covariance.diagonal().tail<3>().cwiseSqrt();
  EXPECT_LT(sigma.maxCoeff(), 0.035);
  // At rest, what an earlier start knows of the bias keeps its tilt away.
  MadeMotion standing;
  MadeWindow again = MakeWindow(standing, 0.0, 11, bias, {}, &random);
  ASSERT_TRUE(Integrate(&again));
  for (Preintegration& part : again.parts) ASSERT_TRUE(part.Reintegrate(bias).ok());
  const auto informed = AlignWindow(&again);
  ASSERT_TRUE(informed.ok()) << informed.status();
  EXPECT_LT(ErrorsOf(informed->last.state, again.truth.back()).tilt_deg, 0.4);
}

// Errors are as large as the covariance says, and as those of its parts belong together.
TEST(AlignInMotion, CovarianceHolds) {
  Random random(test::TestSeed(4), 0);
  InertialOptions options;
  const PoseNoise noise = {options.start.way_sigma_m, options.start.turn_sigma_rad, true};
  double sum = 0.0;
  const int run_count = 120;
  for (int run = 0; run < run_count; ++run) {
    const ImuBias bias = {NormalVector(0.02, &random),
                          NormalVector(options.rest_accel_bias_sigma, &random)};
    MadeWindow window =
        MakeWindow(CarriedMotion(&random), random.Uniform(0.0, 20.0), 8, bias, noise, &random);
    ASSERT_TRUE(Integrate(&window));
    options.start.tilt_sigma_max = 0.05;
    options.start.gravity_error_max = 1.0;
    const auto aligned = AlignWindow(&window, 0.0, options);
    ASSERT_TRUE(aligned.ok()) << aligned.status();
    // Yaw and position are free: the truth is moved to the state's.
    std::vector<InertialState> truth = {window.truth.back()};
    truth[0].map_T_imu.position.setZero();
    const Eigen::Quaterniond off =
        aligned->last.state.map_T_imu.orientation * truth[0].map_T_imu.orientation.conjugate();
    const Eigen::Quaterniond turn = RotationOf({0.0, 0.0, 2.0 * std::atan2(off.z(), off.w())});
    truth[0].map_T_imu.orientation = (turn * truth[0].map_T_imu.orientation).normalized();
    truth[0].velocity_map = turn * truth[0].velocity_map;
    const Vector15d error = StepBetween(aligned->last.state, truth[0]);
    sum += error.dot(aligned->last.covariance.llt().solve(error));
  }
  // Two of tilt, three of speed and six of biases; a standard deviation is 0.04.
  EXPECT_NEAR(sum / run_count / 11.0, 1.0, 0.12);
  RecordProperty("mean_square", std::to_string(sum / run_count / 11.0));
}

TEST(AlignInMotion, WaitsForEnoughKeyframes) {
  Random random(test::TestSeed(1), 0);
  MadeWindow few = MakeWindow(CarriedMotion(&random), 0.0, 4, {}, {}, &random);
  ExpectNotStarted(&few, "4 keyframes; starting in motion takes 5, wait for more");
  MadeWindow near = MakeWindow(CarriedMotion(&random), 0.0, 5, {}, {}, &random, 0.05);
  ASSERT_TRUE(Integrate(&near, 0.05));
  const auto aligned = AlignWindow(&near);
  EXPECT_EQ(aligned.status().code(), absl::StatusCode::kFailedPrecondition) << aligned.status();
  EXPECT_NE(std::string(aligned.status().message()).find("5 keyframes of 0.2 s tell up within"),
            std::string::npos)
      << aligned.status();
}

TEST(AlignInMotion, RefusesPosesThatTheUnitContradicts) {
  Random random(test::TestSeed(1), 0);
  const MadeWindow good = MakeWindow(CarriedMotion(&random), 0.0, 11, {}, {}, &random);
  MadeWindow window = good;
  window.start_T_imu[5].orientation =
      (window.start_T_imu[5].orientation * RotationOf({0.0, 0.05, 0.0})).normalized();
  ExpectNotStarted(&window, "from 800000000 to 1000000000 ns the cameras turned");
  window = good;
  window.start_T_imu[5].position.x() += 0.1;
  ExpectNotStarted(&window, "the cameras moved");
}

TEST(AlignInMotion, SaysWhatIsWrongWithTheSamples) {
  Random random(test::TestSeed(1), 0);
  const MadeWindow good = MakeWindow(CarriedMotion(&random), 0.0, 11, {}, {}, &random);
  MadeWindow window = good;
  for (ImuMeasurement& sample : window.samples) sample.acceleration_m_s2 /= 9.80665;
  ExpectNotStarted(&window, "these look like g, multiply them by 9.80665");
  window = good;
  for (ImuMeasurement& sample : window.samples) sample.angular_velocity_rad_s *= kToDegrees;
  ExpectNotStarted(&window, "these look like degrees/s");
  window = good;
  for (ImuMeasurement& sample : window.samples) {
    sample.angular_velocity_rad_s.head<2>().reverseInPlace();
    sample.acceleration_m_s2.head<2>().reverseInPlace();
  }
  ExpectNotStarted(&window, "are the gyro's y, x, z");
  window = good;
  for (ImuMeasurement& sample : window.samples) sample.angular_velocity_rad_s.x() += 0.3;
  ExpectNotStarted(&window, "the gyro seems to have a bias of");
}

TEST(AlignInMotion, RefusesWhatDoesNotFitTogether) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = MakeWindow(CarriedMotion(&random), 0.0, 11, {}, {}, &random);
  ASSERT_TRUE(Integrate(&window));
  std::vector<Preintegration*> between = window.Between();
  const auto reason_of = [&](std::span<const Pose3d> poses) {
    return ReasonOf(AlignInMotion(poses, between, Adis16448(), 0.0, {}).status());
  };
  EXPECT_EQ(reason_of(std::span(window.start_T_imu).first(10)), Reason::kFieldInvalid);
  std::vector<Pose3d> broken = window.start_T_imu;
  broken[3].position.x() = std::nan("");
  EXPECT_EQ(reason_of(broken), Reason::kFieldInvalid);
  std::swap(between[2], between[3]);
  EXPECT_EQ(reason_of(window.start_T_imu), Reason::kFieldInvalid);
}

TEST(AlignInMotion, DifferentiatesRelativePoses) {
  Random random(test::TestSeed(1), 0);
  for (int round = 0; round < 10; ++round) {
    const Pose3d seen = AnyState(&random).map_T_imu;
    const Pose3d from = AnyState(&random).map_T_imu;
    Vector6d off = Vector6d::Zero();
    for (double& value : off) value = 0.2 * random.Normal();
    const Pose3d to = Stepped(from * seen, off);
    Matrix6d by_from;
    Matrix6d by_to;
    RelativePoseResidual(seen, from, to, &by_from, &by_to);
    for (int column = 0; column < 6; ++column) {
      const Vector6d step = 1e-6 * Vector6d::Unit(column);
      const Vector6d from_slope =
          (RelativePoseResidual(seen, Stepped(from, step), to, nullptr, nullptr) -
           RelativePoseResidual(seen, Stepped(from, -step), to, nullptr, nullptr)) /
          2e-6;
      const Vector6d to_slope =
          (RelativePoseResidual(seen, from, Stepped(to, step), nullptr, nullptr) -
           RelativePoseResidual(seen, from, Stepped(to, -step), nullptr, nullptr)) /
          2e-6;
      EXPECT_LT((from_slope - by_from.col(column)).norm(), 1e-8);
      EXPECT_LT((to_slope - by_to.col(column)).norm(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
