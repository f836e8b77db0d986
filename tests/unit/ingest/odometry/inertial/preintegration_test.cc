// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/preintegration.h"

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

Preintegration Integrated(std::span<const ImuMeasurement> samples, TimeNs from_ns, TimeNs to_ns,
                          const ImuBias& bias = {}) {
  auto result = Preintegration::Make(samples, from_ns, to_ns, bias, Adis16448(), {});
  EXPECT_TRUE(result.ok()) << result.status();
  return *std::move(result);
}

// From the first sample to the last one.
Preintegration Integrated(std::span<const ImuMeasurement> samples, const ImuBias& bias = {}) {
  return Integrated(samples, samples.front().time_ns, samples.back().time_ns, bias);
}

std::vector<ImuMeasurement> ConstantSamples(const Vector3d& rate, const Vector3d& force,
                                            double duration_s, double rate_hz) {
  std::vector<ImuMeasurement> samples = SwungSamples(duration_s, rate_hz);
  for (ImuMeasurement& sample : samples) {
    sample.angular_velocity_rad_s = rate;
    sample.acceleration_m_s2 = force;
  }
  return samples;
}

// Position, rotation and velocity of `to`, seen from `from`.
Vector9d Difference(const ImuIncrement& from, const ImuIncrement& to) {
  Vector9d difference;
  difference << to.position - from.position,
      RotationVectorOf(from.rotation.conjugate() * to.rotation), to.velocity - from.velocity;
  return difference;
}

ImuBias BiasOf(const Vector6d& numbers) { return {numbers.head<3>(), numbers.tail<3>()}; }

TEST(Preintegration, OfAConstantForceIsExact) {
  const Vector3d force(0.3, -1.2, 9.0);
  const ImuBias bias{Vector3d(0.01, 0.02, -0.03), Vector3d(0.1, 0.2, -0.1)};
  const auto samples = ConstantSamples(bias.gyro_rad_s, force + bias.accel_m_s2, 1.0, 200.0);
  // Off the grid of the samples on both sides.
  const Preintegration result = Integrated(samples, 12'345'678, 987'654'321, bias);
  const double t = 0.975308643;
  EXPECT_NEAR(result.duration_s(), t, 1e-15);
  EXPECT_LT((result.increment().velocity - t * force).norm(), 1e-12);
  EXPECT_LT((result.increment().position - 0.5 * t * t * force).norm(), 1e-12);
  EXPECT_LT(RotationVectorOf(result.increment().rotation).norm(), 1e-14);
}

TEST(Preintegration, OfAConstantRateIsExactInRotation) {
  const Vector3d rate(0.4, -0.7, 1.1);
  const auto samples = ConstantSamples(rate, Vector3d::Zero(), 1.0, 200.0);
  const Preintegration result = Integrated(samples, 3'000'001, 998'765'432);
  const Vector3d turn = RotationVectorOf(result.increment().rotation);
  EXPECT_LT((turn - 0.995765431 * rate).norm(), 1e-12);
}

// A force along x that turns about z with the unit: a circle.
TEST(Preintegration, OfATurningForceConvergesBySquares) {
  const double w = 1.5;
  const double force = 9.81;
  const double t = 1.0;
  const Vector3d velocity = force / w * Vector3d(std::sin(w * t), 1.0 - std::cos(w * t), 0.0);
  const Vector3d position =
      force / (w * w) * Vector3d(1.0 - std::cos(w * t), w * t - std::sin(w * t), 0.0);
  double last_error = 0.0;
  for (const double rate_hz : {100.0, 200.0, 400.0}) {
    const auto samples =
        ConstantSamples(Vector3d(0.0, 0.0, w), Vector3d(force, 0.0, 0.0), t, rate_hz);
    const Preintegration result = Integrated(samples);
    const double error = (result.increment().velocity - velocity).norm() +
                         (result.increment().position - position).norm();
    // A tenth of what the accelerometer's noise adds.
    if (rate_hz == 200.0) {
      EXPECT_LT(error, 2e-4);
    }
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error, 4.0, 0.1);
    }
    last_error = error;
  }
}

TEST(Preintegration, OfPartsIsThatOfTheWhole) {
  const auto samples = SwungSamples(1.0, 200.0);
  const TimeNs middle_ns = 432'100'000;
  const Preintegration whole = Integrated(samples, 0, 1'000'000'000);
  const Preintegration first = Integrated(samples, 0, middle_ns);
  const Preintegration second = Integrated(samples, middle_ns, 1'000'000'000);
  const InertialState start;
  const Vector3d gravity(0.0, 0.0, -9.81);
  Matrix15d in_parts = Matrix15d::Zero();
  const InertialState middle = first.Predict(start, gravity, &in_parts);
  const InertialState by_parts = second.Predict(middle, gravity, &in_parts);
  Matrix15d at_once = Matrix15d::Zero();
  const InertialState end = whole.Predict(start, gravity, &at_once);
  // One step is cut in two, which changes what is second order in it.
  EXPECT_LT(StepBetween(end, by_parts).norm(), 1e-5);
  const Vector15d sigma = at_once.diagonal().cwiseSqrt();
  EXPECT_LT((sigma - in_parts.diagonal().cwiseSqrt()).cwiseQuotient(sigma).norm(), 1e-3);
}

TEST(Preintegration, BiasJacobianAgreesWithDifferences) {
  Random random(test::TestSeed(1), 0);
  const auto samples = SwungSamples(1.0, 200.0);
  for (int round = 0; round < 5; ++round) {
    const ImuBias bias{NormalVector(0.05, &random), NormalVector(0.2, &random)};
    const Preintegration result = Integrated(samples, bias);
    for (int i = 0; i < 6; ++i) {
      const double step = 1e-5;
      const auto at = [&](double size) {
        Vector6d numbers;
        numbers << bias.gyro_rad_s, bias.accel_m_s2;
        numbers[i] += size;
        return Integrated(samples, BiasOf(numbers)).increment();
      };
      const Vector9d change =
          (Difference(result.increment(), at(step)) - Difference(result.increment(), at(-step))) /
          (2.0 * step);
      EXPECT_LT((result.bias_jacobian().col(i) - change).norm(), 1e-8) << round << " column " << i;
    }
  }
}

TEST(Preintegration, CorrectionErrsBySquares) {
  const auto samples = SwungSamples(1.0, 200.0);
  const Preintegration start = Integrated(samples);
  Vector6d shift;
  shift << 0.006, -0.005, 0.005, 0.05, 0.06, -0.05;
  double last_error = 0.0;
  for (const double size : {1.0, 0.5}) {
    const ImuBias bias = BiasOf(size * shift);
    const Vector9d error =
        Difference(Integrated(samples, bias).increment(), start.CorrectedFor(bias));
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error.norm(), 4.0, 0.2);
    }
    // Where a new integration is due the error is still below the noise.
    const Vector9d white = start.whitening().topLeftCorner<9, 9>() * error;
    EXPECT_LT(white.norm(), 1.0);
    last_error = error.norm();
  }
  const ImuIncrement same = start.CorrectedFor({});
  EXPECT_LT(Difference(start.increment(), same).norm(), 1e-15);
}

TEST(Preintegration, BeginsAnewWhereBiasesMovedTooFar) {
  const auto samples = SwungSamples(0.5, 200.0);
  Preintegration result = Integrated(samples);
  EXPECT_FALSE(result.IsFarFrom({Vector3d(0.009, 0.0, 0.0), Vector3d(0.0, 0.09, 0.0)}));
  EXPECT_TRUE(result.IsFarFrom({Vector3d(0.009, 0.009, 0.0), Vector3d::Zero()}));
  EXPECT_TRUE(result.IsFarFrom({Vector3d::Zero(), Vector3d(0.0, 0.0, -0.11)}));

  const ImuBias bias{Vector3d(0.03, 0.0, -0.02), Vector3d(0.2, 0.1, 0.0)};
  ASSERT_TRUE(result.Reintegrate(bias).ok());
  const Preintegration expected = Integrated(samples, bias);
  EXPECT_FALSE(result.IsFarFrom(bias));
  EXPECT_EQ(result.increment().position, expected.increment().position);
  EXPECT_EQ(result.increment().rotation.coeffs(), expected.increment().rotation.coeffs());
  EXPECT_EQ(result.increment().velocity, expected.increment().velocity);
  EXPECT_EQ(result.bias_jacobian(), expected.bias_jacobian());
  EXPECT_EQ(result.covariance(), expected.covariance());
  EXPECT_EQ(result.duration_s(), expected.duration_s());
}

TEST(Preintegration, KeepsWhatItHasWhenBiasesAreNoNumbers) {
  Preintegration result = Integrated(SwungSamples(0.5, 200.0));
  const Vector3d position = result.increment().position;
  const absl::Status status =
      result.Reintegrate({Vector3d::Constant(std::nan("")), Vector3d::Zero()});
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid);
  EXPECT_NE(std::string(status.message()).find("imu0"), std::string::npos) << status;
  EXPECT_EQ(result.increment().position, position);
  EXPECT_TRUE(result.Reintegrate({}).ok());
  EXPECT_EQ(result.increment().position, position);
}

TEST(Preintegration, CovarianceAtRestFollowsTheClosedForms) {
  const ImuCalibration unit = Adis16448();
  const double g = 9.81;
  const Preintegration result =
      Integrated(ConstantSamples(Vector3d::Zero(), Vector3d(0.0, 0.0, g), 1.0, 200.0));
  const double sg2 = std::pow(unit.gyro_noise_density, 2);
  const double sa2 = std::pow(unit.accel_noise_density, 2);
  const double wg2 = std::pow(unit.gyro_random_walk, 2);
  const double wa2 = std::pow(unit.accel_random_walk, 2);
  const Matrix15d& c = result.covariance();
  // After 1 s, upwards.
  EXPECT_NEAR(c(5, 5), sg2 + wg2 / 3.0, 0.01 * sg2);
  EXPECT_NEAR(c(8, 8), sa2 + wa2 / 3.0, 0.02 * sa2);
  EXPECT_NEAR(c(2, 2), sa2 / 3.0 + wa2 / 20.0, 0.02 * sa2);
  // Sideways gravity leaks in through the tilt.
  EXPECT_NEAR(c(0, 0), sa2 / 3.0 + wa2 / 20.0 + g * g * (sg2 / 20.0 + wg2 / 252.0), 0.02 * sa2);
  EXPECT_NEAR(c(9, 9), wg2, 1e-9 * wg2);
  EXPECT_NEAR(c(14, 14), wa2, 1e-9 * wa2);
  // A bias that walks is a force that was not there: the integral of its covariance with itself.
  EXPECT_NEAR(c(8, 14), -wa2 / 2.0, 0.01 * wa2);
  EXPECT_EQ(c, Matrix15d(c.transpose()));
  const Matrix15d white = result.whitening() * c * result.whitening().transpose();
  EXPECT_LT((white - Matrix15d::Identity()).norm(), 1e-6);
}

// Made with noise of the data sheet, integrated with its model: the errors are the model's.
TEST(Preintegration, CovarianceIsThatOfManyNoisyRuns) {
  Random random(test::TestSeed(2), 0);
  const ImuCalibration unit = Adis16448();
  const auto samples = SwungSamples(0.5, 200.0);
  const Preintegration truth = Integrated(samples);
  const int run_count = 1000;
  double sum = 0.0;
  int within_count = 0;
  Matrix15d second = Matrix15d::Zero();
  for (int run = 0; run < run_count; ++run) {
    ImuBias bias;
    const Preintegration noisy = Integrated(Noisy(samples, unit, &random, &bias));
    Vector15d error;
    error << Difference(noisy.increment(), truth.increment()), bias.gyro_rad_s, bias.accel_m_s2;
    const Vector15d white = noisy.whitening() * error;
    sum += white.squaredNorm();
    // 95 % of 15 degrees of freedom.
    within_count += white.squaredNorm() <= 24.9958 ? 1 : 0;
    second += white * white.transpose() / static_cast<double>(run_count);
  }
  RecordProperty("mean_normalized_square", std::to_string(sum / run_count / 15.0));
  RecordProperty("share_within_95", std::to_string(1.0 * within_count / run_count));
  EXPECT_NEAR(sum / run_count / 15.0, 1.0, 0.05);
  EXPECT_NEAR(1.0 * within_count / run_count, 0.95, 0.025);
  // Each row and each pair of rows, five standard deviations of what is counted.
  EXPECT_LT((second - Matrix15d::Identity()).cwiseAbs().maxCoeff(), 5.0 * std::sqrt(2.0 / 1000.0));
}

TEST(Preintegration, MissingSamplesMakeItLessSure) {
  auto samples = SwungSamples(0.5, 200.0);
  const Preintegration whole = Integrated(samples);
  // 45 ms without a sample.
  samples.erase(samples.begin() + 40, samples.begin() + 48);
  const Preintegration holed = Integrated(samples);
  for (const int row : {kRotationRow, kVelocityRow, kPositionRow}) {
    const double before = whole.covariance().diagonal().segment<3>(row).sum();
    const double after = holed.covariance().diagonal().segment<3>(row).sum();
    EXPECT_GT(after, 1.2 * before) << row;
    EXPECT_LT(after, 3.0 * before) << row;
  }
}

TEST(Preintegration, OneStepHasAnInverseCovarianceToo) {
  const Preintegration result = Integrated(SwungSamples(0.1, 200.0), 6'000'000, 7'000'000);
  const Matrix15d white = result.whitening() * result.covariance() * result.whitening().transpose();
  EXPECT_LT((white - Matrix15d::Identity()).norm(), 1e-6);
}

TEST(Preintegration, PredictsWithTheCovarianceOfItsDifferences) {
  Random random(test::TestSeed(3), 0);
  const Vector3d gravity(0.0, 0.0, -9.81);
  const Preintegration measured = Integrated(SwungSamples(0.5, 200.0));
  const InertialState from = AnyState(&random);
  Matrix15d start;
  for (double& value : start.reshaped()) value = 0.01 * random.Normal();
  start = Matrix15d(start * start.transpose());
  Matrix15d covariance = start;
  const InertialState to = measured.Predict(from, gravity, &covariance);
  EXPECT_LT(StepBetween(to, measured.Predict(from, gravity, nullptr)).norm(), 1e-15);

  Matrix15d by_from;
  for (int i = 0; i < 15; ++i) {
    const double size = 1e-6;
    const auto at = [&](double step) {
      const InertialState moved = Stepped(from, step * Vector15d::Unit(i));
      return StepBetween(to, measured.Predict(moved, gravity, nullptr));
    };
    by_from.col(i) = (at(size) - at(-size)) / (2.0 * size);
  }
  Matrix15d turned = Matrix15d::Identity();
  turned.block<3, 3>(0, 0) = from.map_T_imu.orientation.toRotationMatrix();
  turned.block<3, 3>(6, 6) = from.map_T_imu.orientation.toRotationMatrix();
  const Matrix15d expected =
      by_from * start * by_from.transpose() + turned * measured.covariance() * turned.transpose();
  EXPECT_LT((covariance - expected).norm(), 1e-7 * expected.norm());
}

TEST(Preintegration, RefusesUnitsWithoutNoise) {
  const auto samples = SwungSamples(0.1, 200.0);
  ImuCalibration unit = Adis16448();
  unit.accel_random_walk = 0.0;
  const auto silent = Preintegration::Make(samples, 0, 100'000'000, {}, unit, {});
  EXPECT_EQ(ReasonOf(silent.status()), Reason::kFieldInvalid);
  EXPECT_NE(std::string(silent.status().message()).find("accelerometer_random_walk is 0"),
            std::string::npos)
      << silent.status();
  unit.accel_random_walk = -1.0;
  EXPECT_FALSE(Preintegration::Make(samples, 0, 100'000'000, {}, unit, {}).ok());
}

TEST(Preintegration, RefusesNumbersThatOverflow) {
  auto samples = SwungSamples(0.1, 200.0);
  samples[5].acceleration_m_s2.x() = 1e300;
  const auto result = Preintegration::Make(samples, 0, 100'000'000, {}, Adis16448(), {});
  EXPECT_EQ(ReasonOf(result.status()), Reason::kFieldInvalid) << result.status();
}

TEST(Preintegration, RefusesWhatSamplesAreRefusedFor) {
  const auto samples = SwungSamples(0.1, 200.0);
  EXPECT_TRUE(Preintegration::Make(samples, 0, 1, {}, Adis16448(), {}).ok());
  EXPECT_EQ(ReasonOf(Preintegration::Make(samples, 0, 200'000'000, {}, Adis16448(), {}).status()),
            Reason::kTimeOutsideTrack);
  InertialOptions options;
  options.gap_ns_max = 4'000'000;
  const auto strict = Preintegration::Make(samples, 0, 100'000'000, {}, Adis16448(), options);
  EXPECT_EQ(ReasonOf(strict.status()), Reason::kFieldInvalid) << strict.status();
}

TEST(InertialOptions, DefaultsAreInTheirRanges) {
  EXPECT_TRUE(ValidateOptions(InertialOptions()).ok());
  EXPECT_EQ(DigestOptions(InertialOptions()), "");
}

}  // namespace
}  // namespace dsg::ingest
