// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/preintegration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix96d = Eigen::Matrix<double, 9, 6>;

// Of the integration itself, m/sqrt(s): keeps the covariance of one or two samples invertible.
constexpr double kIntegrationDensity = 1e-8;

absl::Status CheckNoise(const ImuCalibration& unit) {
  DSG_RETURN_IF_ERROR(unit.Validate());
  for (const auto& [field, value] :
       {std::pair("gyroscope_noise_density", unit.gyro_noise_density),
        std::pair("gyroscope_random_walk", unit.gyro_random_walk),
        std::pair("accelerometer_noise_density", unit.accel_noise_density),
        std::pair("accelerometer_random_walk", unit.accel_random_walk)}) {
    if (value > 0.0) continue;
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(unit.name, ": ", field,
                                  " is 0, and no unit is without noise; give that of its data "
                                  "sheet"),
                     {{"field", absl::StrCat(unit.name, ".", field)}, {"value", "0"}});
  }
  return absl::OkStatus();
}

// How an error of (position, rotation, velocity, gyro bias, accelerometer bias) grows over a step.
// The last six columns are also how noise of gyro and accelerometer enters.
Matrix15d TransitionOf(const Matrix3d& start, const Vector3d& turn, const Vector3d& force,
                       double dt) {
  const Matrix3d half_turn = RotationOf(0.5 * turn).toRotationMatrix();
  const Matrix3d middle = start * half_turn;
  // Of the turned force, by a turn on the right of `middle`.
  const Matrix3d lever = -middle * CrossMatrix(force);
  const Matrix3d by_rotation = lever * half_turn.transpose();
  const Matrix3d by_gyro = -0.5 * dt * lever * RightJacobian(0.5 * turn);
  Matrix15d a = Matrix15d::Identity();
  a.block<3, 3>(kPositionRow, kRotationRow) = 0.5 * dt * dt * by_rotation;
  a.block<3, 3>(kPositionRow, kVelocityRow) = dt * Matrix3d::Identity();
  a.block<3, 3>(kPositionRow, kGyroBiasRow) = 0.5 * dt * dt * by_gyro;
  a.block<3, 3>(kPositionRow, kAccelBiasRow) = -0.5 * dt * dt * middle;
  a.block<3, 3>(kRotationRow, kRotationRow) = RotationOf(-turn).toRotationMatrix();
  a.block<3, 3>(kRotationRow, kGyroBiasRow) = -dt * RightJacobian(turn);
  a.block<3, 3>(kVelocityRow, kRotationRow) = dt * by_rotation;
  a.block<3, 3>(kVelocityRow, kGyroBiasRow) = dt * by_gyro;
  a.block<3, 3>(kVelocityRow, kAccelBiasRow) = -dt * middle;
  return a;
}

}  // namespace

absl::StatusOr<Preintegration> Preintegration::Make(std::span<const ImuMeasurement> samples,
                                                    TimeNs from_ns, TimeNs to_ns,
                                                    const ImuBias& bias,
                                                    const ImuCalibration& calibration,
                                                    const InertialOptions& options) {
  DSG_RETURN_IF_ERROR(CheckNoise(calibration));
  Preintegration result;
  DSG_ASSIGN_OR_RETURN(result.samples_,
                       CutSamples(samples, from_ns, to_ns, calibration.name, options.gap_ns_max));
  result.calibration_ = calibration;
  result.gyro_bias_shift_max_ = options.gyro_bias_shift_max;
  result.accel_bias_shift_max_ = options.accel_bias_shift_max;
  result.duration_s_ = SecondsBetween(from_ns, to_ns);
  DSG_RETURN_IF_ERROR(result.Reintegrate(bias));
  return result;
}

absl::Status Preintegration::Reintegrate(const ImuBias& bias) {
  Preintegration next;
  next.samples_ = std::move(samples_);
  next.calibration_ = calibration_;
  next.bias_ = bias;
  for (size_t i = 1; i < next.samples_.size(); ++i) {
    next.Integrate(next.samples_[i - 1], next.samples_[i]);
  }
  samples_ = std::move(next.samples_);
  const Eigen::LLT<Matrix15d> root(next.covariance_);
  const bool is_finite = next.covariance_.allFinite() && next.bias_jacobian_.allFinite() &&
                         next.increment_.position.allFinite() &&
                         next.increment_.velocity.allFinite() &&
                         next.increment_.rotation.coeffs().allFinite();
  if (!is_finite || root.info() != Eigen::Success) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat(calibration_.name, ": samples from ", from_ns(), " to ", to_ns(),
                     " ns do not integrate to finite numbers; check their units and the biases"),
        {{"field", calibration_.name}, {"value", absl::StrCat(from_ns())}});
  }
  bias_ = bias;
  increment_ = next.increment_;
  bias_jacobian_ = next.bias_jacobian_;
  covariance_ = next.covariance_;
  whitening_ = root.matrixL().solve(Matrix15d::Identity());
  return absl::OkStatus();
}

void Preintegration::Integrate(const ImuMeasurement& from, const ImuMeasurement& to) {
  const double dt = SecondsBetween(from.time_ns, to.time_ns);
  const Vector3d turn =
      dt * (0.5 * (from.angular_velocity_rad_s + to.angular_velocity_rad_s) - bias_.gyro_rad_s);
  const Vector3d force = 0.5 * (from.acceleration_m_s2 + to.acceleration_m_s2) - bias_.accel_m_s2;
  const Matrix15d a = TransitionOf(increment_.rotation.toRotationMatrix(), turn, force, dt);

  const Vector3d gain = dt * (increment_.rotation * RotationOf(0.5 * turn) * force);
  increment_.position += dt * increment_.velocity + 0.5 * dt * gain;
  increment_.velocity += gain;
  increment_.rotation = (increment_.rotation * RotationOf(turn)).normalized();

  const Matrix96d by_noise = a.topRightCorner<9, 6>();
  const Matrix96d jacobian = a.topLeftCorner<9, 9>() * bias_jacobian_ + by_noise;
  bias_jacobian_ = jacobian;

  // The mean over a step has the variance density^2 / dt. Where samples are missing it is that of
  // the mean of two samples, however long the step.
  const double rate_hz = std::max(1.0 / dt, 0.5 * calibration_.rate_hz);
  const auto square = [](double density) { return Vector3d::Constant(density * density); };
  Vector6d noise;
  noise << rate_hz * square(calibration_.gyro_noise_density),
      rate_hz * square(calibration_.accel_noise_density);
  Matrix15d next = a * covariance_ * a.transpose();
  next.topLeftCorner<9, 9>() += by_noise * noise.asDiagonal() * by_noise.transpose();
  next.diagonal().segment<3>(kPositionRow) += dt * square(kIntegrationDensity);
  next.diagonal().segment<3>(kGyroBiasRow) += dt * square(calibration_.gyro_random_walk);
  next.diagonal().segment<3>(kAccelBiasRow) += dt * square(calibration_.accel_random_walk);
  covariance_ = 0.5 * (next + next.transpose());
}

ImuIncrement Preintegration::CorrectedFor(const ImuBias& bias) const {
  Vector6d shift;
  shift << bias.gyro_rad_s - bias_.gyro_rad_s, bias.accel_m_s2 - bias_.accel_m_s2;
  const Vector9d change = bias_jacobian_ * shift;
  return {increment_.position + change.segment<3>(kPositionRow),
          increment_.rotation * RotationOf(change.segment<3>(kRotationRow)),
          increment_.velocity + change.segment<3>(kVelocityRow)};
}

bool Preintegration::IsFarFrom(const ImuBias& bias) const {
  return (bias.gyro_rad_s - bias_.gyro_rad_s).norm() > gyro_bias_shift_max_ ||
         (bias.accel_m_s2 - bias_.accel_m_s2).norm() > accel_bias_shift_max_;
}

InertialState Preintegration::Predict(const InertialState& from, const Vector3d& gravity_map,
                                      Matrix15d* covariance) const {
  const ImuIncrement moved = CorrectedFor(from.bias);
  const Matrix3d map_R_from = from.map_T_imu.orientation.toRotationMatrix();
  const double t = duration_s_;
  InertialState to = from;
  to.map_T_imu.position +=
      t * from.velocity_map + 0.5 * t * t * gravity_map + map_R_from * moved.position;
  to.map_T_imu.orientation = (from.map_T_imu.orientation * moved.rotation).normalized();
  to.velocity_map += t * gravity_map + map_R_from * moved.velocity;
  if (covariance == nullptr) return to;

  Matrix15d by_from = Matrix15d::Identity();
  by_from.block<3, 3>(kPositionRow, kRotationRow) = -map_R_from * CrossMatrix(moved.position);
  by_from.block<3, 3>(kPositionRow, kVelocityRow) = t * Matrix3d::Identity();
  by_from.block<3, 6>(kPositionRow, kGyroBiasRow) =
      map_R_from * bias_jacobian_.middleRows<3>(kPositionRow);
  by_from.block<3, 3>(kRotationRow, kRotationRow) = moved.rotation.conjugate().toRotationMatrix();
  const Vector3d shift_turn =
      bias_jacobian_.block<3, 3>(kRotationRow, 0) * (from.bias.gyro_rad_s - bias_.gyro_rad_s);
  by_from.block<3, 3>(kRotationRow, kGyroBiasRow) =
      RightJacobian(shift_turn) * bias_jacobian_.block<3, 3>(kRotationRow, 0);
  by_from.block<3, 3>(kVelocityRow, kRotationRow) = -map_R_from * CrossMatrix(moved.velocity);
  by_from.block<3, 6>(kVelocityRow, kGyroBiasRow) =
      map_R_from * bias_jacobian_.middleRows<3>(kVelocityRow);
  Matrix15d by_noise = Matrix15d::Identity();
  by_noise.block<3, 3>(kPositionRow, kPositionRow) = map_R_from;
  by_noise.block<3, 3>(kVelocityRow, kVelocityRow) = map_R_from;
  const Matrix15d sum =
      by_from * *covariance * by_from.transpose() + by_noise * covariance_ * by_noise.transpose();
  *covariance = 0.5 * (sum + sum.transpose());
  return to;
}

}  // namespace dsg::ingest
