// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/alignment.h"

#include <Eigen/Geometry>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/inertial/alignment_internal.h"
#include "ingest/odometry/inertial/imu_faults.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What standing still means, m/s. Not 0, so that solvers can invert the covariance.
constexpr double kRestSigma = 1e-3;

struct Spread {
  Vector3d mean = Vector3d::Zero();
  /// Standard deviation of each axis.
  Vector3d sigma = Vector3d::Zero();
};

Spread SpreadOf(std::span<const ImuMeasurement> samples, Vector3d ImuMeasurement::*part) {
  Spread spread;
  const double count = static_cast<double>(samples.size());
  for (const ImuMeasurement& sample : samples) spread.mean += sample.*part / count;
  Vector3d squares = Vector3d::Zero();
  for (const ImuMeasurement& sample : samples) {
    squares += (sample.*part - spread.mean).cwiseAbs2() / count;
  }
  spread.sigma = squares.cwiseSqrt();
  return spread;
}

absl::Status CheckRest(const ImuCalibration& unit, const Spread& rate, const Spread& force,
                       const InertialOptions& options) {
  if (!(force.sigma.maxCoeff() <= options.rest_accel_sigma_max)) {
    return NotYet(unit, absl::StrCat("it moves: acceleration varies by ", force.sigma.maxCoeff(),
                                     " m/s^2, at rest by at most ", options.rest_accel_sigma_max));
  }
  if (!(rate.sigma.maxCoeff() <= options.rest_gyro_sigma_max)) {
    return NotYet(unit, absl::StrCat("it turns: its rate varies by ", rate.sigma.maxCoeff(),
                                     " rad/s, at rest by at most ", options.rest_gyro_sigma_max));
  }
  if (!(rate.mean.norm() <= options.rest_rate_max)) {
    return NotYet(unit, absl::StrCat("it turns by ", rate.mean.norm(),
                                     " rad/s all the time; a bias is at most ",
                                     options.rest_rate_max, "; check that these are no degrees"));
  }
  if (!(std::abs(force.mean.norm() - options.gravity_m_s2) <= options.rest_gravity_error_max)) {
    return NotYet(unit, absl::StrCat("it feels ", force.mean.norm(), " m/s^2 and not gravity, ",
                                     options.gravity_m_s2, " +- ", options.rest_gravity_error_max,
                                     "; ", GuessAtForce(force.mean.norm(), options)));
  }
  return absl::OkStatus();
}

Matrix15d CovarianceAtRest(const ImuCalibration& unit, const Vector3d& up_imu, double span_s,
                           const InertialOptions& options) {
  const auto square = [](double value) { return value * value; };
  Matrix15d covariance = Matrix15d::Zero();
  covariance.diagonal().segment<3>(kPositionRow).setConstant(square(kOriginSigma));
  covariance.diagonal().segment<3>(kVelocityRow).setConstant(square(kRestSigma));
  covariance.diagonal()
      .segment<3>(kGyroBiasRow)
      .setConstant(square(unit.gyro_noise_density) / span_s +
                   square(unit.gyro_random_walk) * span_s / 3.0);
  // A force b that is no gravity tilts what is taken as up by (up x b) / g.
  const Matrix3d tilt_by_force = CrossMatrix(up_imu) / options.gravity_m_s2;
  const double bias_variance = square(options.rest_accel_bias_sigma);
  const double mean_variance = square(unit.accel_noise_density) / span_s;
  covariance.block<3, 3>(kRotationRow, kRotationRow) =
      (bias_variance + mean_variance) * tilt_by_force * tilt_by_force.transpose() +
      square(kYawSigma) * up_imu * up_imu.transpose();
  covariance.block<3, 3>(kRotationRow, kAccelBiasRow) = bias_variance * tilt_by_force;
  covariance.block<3, 3>(kAccelBiasRow, kRotationRow) = bias_variance * tilt_by_force.transpose();
  covariance.diagonal().segment<3>(kAccelBiasRow).setConstant(bias_variance);
  return covariance;
}

}  // namespace

absl::StatusOr<AlignedState> AlignAtRest(std::span<const ImuMeasurement> samples,
                                         const ImuCalibration& calibration, double yaw_rad,
                                         const InertialOptions& options) {
  DSG_RETURN_IF_ERROR(calibration.Validate());
  DSG_RETURN_IF_ERROR(CheckSamples(samples, calibration.name, options.gap_ns_max));
  const double span_s =
      samples.empty() ? 0.0 : SecondsBetween(samples.front().time_ns, samples.back().time_ns);
  const double due_s = 1e-9 * static_cast<double>(options.rest_ns);
  // A period may be missing, since n samples span n - 1 of them.
  if (span_s < due_s - 1.5 / calibration.rate_hz) {
    return NotYet(calibration, absl::StrCat("samples of ", span_s, " s; standing still is told of ",
                                            due_s, " s, wait for more"));
  }
  const Spread rate = SpreadOf(samples, &ImuMeasurement::angular_velocity_rad_s);
  const Spread force = SpreadOf(samples, &ImuMeasurement::acceleration_m_s2);
  DSG_RETURN_IF_ERROR(CheckRest(calibration, rate, force, options));

  const Vector3d up_imu = force.mean.normalized();
  AlignedState aligned;
  aligned.state.map_T_imu.orientation = UprightOrientation(up_imu, yaw_rad);
  aligned.state.bias.gyro_rad_s = rate.mean;
  aligned.covariance = CovarianceAtRest(calibration, up_imu, span_s, options);
  return aligned;
}

}  // namespace dsg::ingest
