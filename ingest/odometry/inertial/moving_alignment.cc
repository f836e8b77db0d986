// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/moving_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/inertial/alignment_internal.h"
#include "ingest/odometry/inertial/imu_faults.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "ingest/odometry/inertial/path_fit.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Rounds of fitting the gyro's bias, and steps in each: a bias of ten degrees a second is found in
// two rounds, and steps shrink by a factor of a hundred.
constexpr int kBiasRoundCount = 4;
constexpr int kBiasStepCount = 3;

absl::Status BadPath(const ImuCalibration& unit, const std::string& what,
                     const std::string& value) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat(unit.name, ": ", what),
                   {{"field", unit.name}, {"value", value}});
}

absl::Status CheckPath(const PathMeasurements& path, const ImuCalibration& unit,
                       const InertialOptions& options) {
  const size_t count = path.start_T_imu.size();
  if (count < static_cast<size_t>(options.start.keyframe_count_min)) {
    return NotYet(unit, absl::StrCat(count, " keyframes; starting in motion takes ",
                                     options.start.keyframe_count_min, ", wait for more"));
  }
  if (path.between.size() + 1 != count) {
    return BadPath(unit,
                   absl::StrCat(path.between.size(), " integrations do not lie between ", count,
                                " keyframes; give one less than keyframes"),
                   absl::StrCat(path.between.size()));
  }
  for (size_t i = 0; i < count; ++i) {
    if (!IsValidPose(path.start_T_imu[i])) {
      return BadPath(unit,
                     absl::StrCat("the pose of keyframe ", i,
                                  " is none; give finite numbers "
                                  "and a unit quaternion"),
                     absl::StrCat(i));
    }
    if (i < 2 || path.between[i - 2]->to_ns() == path.between[i - 1]->from_ns()) continue;
    return BadPath(unit,
                   absl::StrCat("an integration ends at ", path.between[i - 2]->to_ns(),
                                " ns and the next one begins at ", path.between[i - 1]->from_ns(),
                                " ns; each begins where the one before ends"),
                   absl::StrCat(path.between[i - 1]->from_ns()));
  }
  return absl::OkStatus();
}

// All of them, each instant once.
std::vector<ImuMeasurement> SamplesOf(const PathMeasurements& path) {
  std::vector<ImuMeasurement> samples;
  for (const Preintegration* measured : path.between) {
    const auto own = measured->samples();
    samples.insert(samples.end(), own.begin() + (samples.empty() ? 0 : 1), own.end());
  }
  return samples;
}

// What samples and turns reveal, each behind "; ".
std::string FaultTexts(const PathMeasurements& path, const ImuCalibration& unit,
                       const InertialOptions& options) {
  std::vector<SeenTurn> turns;
  for (size_t i = 0; i < path.between.size(); ++i) {
    turns.push_back({path.between[i]->samples(), path.RelativePose(i).orientation});
  }
  std::string texts;
  for (const ImuFault& fault : FaultsOfTurns(turns, unit.name, options)) {
    absl::StrAppend(&texts, "; ", fault.text);
  }
  for (const ImuFault& fault : FaultsOfSamples(SamplesOf(path), unit.name, options)) {
    absl::StrAppend(&texts, "; ", fault.text);
  }
  return texts;
}

// What the cameras saw the unit turn by, further than it measured itself with a gyro bias.
Vector3d TurnMisfit(const PathMeasurements& path, size_t i, const ImuBias& bias) {
  const Eigen::Quaterniond measured = path.between[i]->CorrectedFor(bias).rotation;
  return RotationVectorOf((measured.conjugate() * path.RelativePose(i).orientation).normalized());
}

double TurnVariance(const Preintegration& measured, const InertialOptions& options) {
  const double sigma = options.start.turn_sigma_rad;
  return sigma * sigma +
         measured.covariance().block<3, 3>(kRotationRow, kRotationRow).trace() / 3.0;
}

// One step of Gauss-Newton from `bias` on.
Vector3d GyroBiasStep(const PathMeasurements& path, const ImuBias& bias,
                      const InertialOptions& options) {
  Matrix3d hessian = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  for (size_t i = 0; i < path.between.size(); ++i) {
    const Preintegration& measured = *path.between[i];
    const Vector3d misfit = TurnMisfit(path, i, bias);
    const Matrix3d by_bias = measured.bias_jacobian().block<3, 3>(kRotationRow, 0);
    const Vector3d shift = by_bias * (bias.gyro_rad_s - measured.bias().gyro_rad_s);
    const Matrix3d jacobian = -InverseRightJacobian(misfit) *
                              RotationOf(-misfit).toRotationMatrix() * RightJacobian(shift) *
                              by_bias;
    const double weight = 1.0 / TurnVariance(measured, options);
    hessian += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * misfit;
  }
  return -hessian.ldlt().solve(gradient);
}

// Integrates anew until the gyro's bias is near that of all integrations.
absl::StatusOr<ImuBias> FitGyroBias(const PathMeasurements& path, const InertialOptions& options) {
  ImuBias bias = path.between.front()->bias();
  for (int round = 0; round < kBiasRoundCount; ++round) {
    for (int step = 0; step < kBiasStepCount; ++step) {
      bias.gyro_rad_s += GyroBiasStep(path, bias, options);
    }
    bool is_near = true;
    for (Preintegration* measured : path.between) {
      const ImuBias shifted = {bias.gyro_rad_s, measured->bias().accel_m_s2};
      if (!measured->IsFarFrom(shifted)) continue;
      is_near = false;
      DSG_RETURN_IF_ERROR(measured->Reintegrate(shifted));
    }
    if (is_near) break;
  }
  return bias;
}

absl::Status CheckTurns(const PathMeasurements& path, const ImuCalibration& unit,
                        const ImuBias& bias, const InertialOptions& options) {
  for (size_t i = 0; i < path.between.size(); ++i) {
    const Preintegration& measured = *path.between[i];
    const double misfit = TurnMisfit(path, i, bias).norm();
    const double misfit_max =
        options.start.misfit_sigma_max * std::sqrt(TurnVariance(measured, options));
    // Not a number is none that fits.
    if (misfit <= misfit_max) continue;
    return NotYet(unit, absl::StrCat("from ", measured.from_ns(), " to ", measured.to_ns(),
                                     " ns the cameras turned ", misfit,
                                     " rad otherwise than the gyro, whose bias seems to be ",
                                     bias.gyro_rad_s.norm(), " rad/s; they may differ by ",
                                     misfit_max, FaultTexts(path, unit, options)));
  }
  if (bias.gyro_rad_s.norm() <= options.rest_rate_max) return absl::OkStatus();
  return NotYet(unit, absl::StrCat("against the cameras the gyro seems to have a bias of ",
                                   bias.gyro_rad_s.norm(), " rad/s; one is at most ",
                                   options.rest_rate_max, FaultTexts(path, unit, options)));
}

// Gravity and the accelerometer's bias in the start frame, and velocities there at all keyframes.
struct FreePath {
  Eigen::Matrix3Xd velocities;
  Vector3d gravity = Vector3d::Zero();
  Vector3d accel_bias = Vector3d::Zero();
  Matrix3d gravity_covariance = Matrix3d::Zero();
};

// Position and velocity at the end of an integration, linear in velocities, gravity and bias: a
// weighted row of each axis, and what it should be.
struct FreeRows {
  Eigen::MatrixXd jacobian;
  Vector6d values;
};

// Turns are as the cameras saw them.
FreeRows FreeRowsOf(const PathMeasurements& path, size_t i, const ImuBias& bias,
                    const InertialOptions& options) {
  const Preintegration& measured = *path.between[i];
  const double t = measured.duration_s();
  const Matrix3d start_R_from = path.start_T_imu[i].orientation.toRotationMatrix();
  const ImuIncrement moved = measured.CorrectedFor({bias.gyro_rad_s, Vector3d::Zero()});
  const auto& by_bias = measured.bias_jacobian();
  const Eigen::Index velocity_at = 3 * static_cast<Eigen::Index>(i);
  const Eigen::Index gravity_at = 3 * std::ssize(path.start_T_imu);
  const Eigen::Index bias_at = gravity_at + 3;
  FreeRows rows = {Eigen::MatrixXd::Zero(6, bias_at + 3), Vector6d::Zero()};
  rows.jacobian.block<3, 3>(0, velocity_at) = t * Matrix3d::Identity();
  rows.jacobian.block<3, 3>(0, gravity_at) = 0.5 * t * t * Matrix3d::Identity();
  rows.jacobian.block<3, 3>(0, bias_at) = start_R_from * by_bias.block<3, 3>(kPositionRow, 3);
  rows.jacobian.block<3, 3>(3, velocity_at) = -Matrix3d::Identity();
  rows.jacobian.block<3, 3>(3, velocity_at + 3) = Matrix3d::Identity();
  rows.jacobian.block<3, 3>(3, gravity_at) = -t * Matrix3d::Identity();
  rows.jacobian.block<3, 3>(3, bias_at) = -start_R_from * by_bias.block<3, 3>(kVelocityRow, 3);
  rows.values << path.start_T_imu[i + 1].position - path.start_T_imu[i].position -
                     start_R_from * moved.position,
      start_R_from * moved.velocity;
  const Matrix15d& noise = measured.covariance();
  const double way_sigma = options.start.way_sigma_m;
  // The cameras' turns turn gravity, too.
  const double speed_sigma = options.gravity_m_s2 * t * options.start.turn_sigma_rad;
  const double way_variance =
      way_sigma * way_sigma + noise.block<3, 3>(kPositionRow, kPositionRow).trace() / 3.0;
  const double speed_variance =
      speed_sigma * speed_sigma + noise.block<3, 3>(kVelocityRow, kVelocityRow).trace() / 3.0;
  Vector6d weights;
  weights << Vector3d::Constant(1.0 / std::sqrt(way_variance)),
      Vector3d::Constant(1.0 / std::sqrt(speed_variance));
  rows.jacobian = weights.asDiagonal() * Eigen::MatrixXd(rows.jacobian);
  rows.values = weights.cwiseProduct(Vector6d(rows.values));
  return rows;
}

FreePath FitFreePath(const PathMeasurements& path, const ImuBias& bias,
                     const InertialOptions& options) {
  const Eigen::Index gravity_at = 3 * std::ssize(path.start_T_imu);
  const Eigen::Index size = gravity_at + 6;
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (size_t i = 0; i < path.between.size(); ++i) {
    const FreeRows rows = FreeRowsOf(path, i, bias, options);
    hessian.noalias() += rows.jacobian.transpose() * rows.jacobian;
    right.noalias() += rows.jacobian.transpose() * rows.values;
  }
  const double bias_weight = 1.0 / (options.rest_accel_bias_sigma * options.rest_accel_bias_sigma);
  hessian.diagonal().tail<3>().array() += bias_weight;
  right.tail<3>() += bias_weight * path.known_accel_bias;

  const auto root = hessian.ldlt();
  const Eigen::VectorXd solution = root.solve(right);
  Eigen::MatrixXd gravity_columns = Eigen::MatrixXd::Zero(size, 3);
  gravity_columns.middleRows<3>(gravity_at).setIdentity();
  FreePath free;
  free.velocities = solution.head(gravity_at).reshaped(3, gravity_at / 3);
  free.gravity = solution.segment<3>(gravity_at);
  free.accel_bias = solution.tail<3>();
  free.gravity_covariance = root.solve(gravity_columns).middleRows<3>(gravity_at);
  return free;
}

absl::Status CheckGravity(const PathMeasurements& path, const ImuCalibration& unit,
                          const FreePath& free, const InertialOptions& options) {
  const double span_s =
      SecondsBetween(path.between.front()->from_ns(), path.between.back()->to_ns());
  const Matrix3d across =
      Matrix3d::Identity() - free.gravity.normalized() * free.gravity.normalized().transpose();
  const Matrix3d covariance = across * free.gravity_covariance * across;
  // Not of the gravity that was found, which may be none.
  const double tilt_sigma =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvalues()[2]) /
      options.gravity_m_s2;
  if (!(tilt_sigma <= options.start.tilt_sigma_max)) {
    return NotYet(unit, absl::StrCat(path.start_T_imu.size(), " keyframes of ", span_s,
                                     " s tell up within ", tilt_sigma, " rad; starting takes ",
                                     options.start.tilt_sigma_max, ", wait for more"));
  }
  const double length = free.gravity.norm();
  if (std::abs(length - options.gravity_m_s2) <= options.start.gravity_error_max) {
    return absl::OkStatus();
  }
  const std::string faults = FaultTexts(path, unit, options);
  return NotYet(unit, absl::StrCat("gravity comes out as ", length, " m/s^2 and not ",
                                   options.gravity_m_s2, " +- ", options.start.gravity_error_max,
                                   faults.empty() ? "; check the accelerometer's axes and scale, "
                                                    "and the distances of the cameras"
                                                  : faults));
}

// In a map whose z axis points up; where its origin is and how it is turned does not matter.
std::vector<InertialState> StatesOf(const PathMeasurements& path, const ImuBias& bias,
                                    const FreePath& free) {
  const auto map_R_start = Eigen::Quaterniond::FromTwoVectors(-free.gravity, Vector3d::UnitZ());
  std::vector<InertialState> states;
  for (size_t i = 0; i < path.start_T_imu.size(); ++i) {
    const Pose3d& pose = path.start_T_imu[i];
    states.push_back({{map_R_start * pose.position, map_R_start * pose.orientation},
                      map_R_start * free.velocities.col(static_cast<Eigen::Index>(i)),
                      {bias.gyro_rad_s, free.accel_bias}});
  }
  return states;
}

absl::Status CheckFit(const PathMeasurements& path, const ImuCalibration& unit,
                      const std::vector<InertialState>& states, const InertialOptions& options) {
  for (size_t i = 0; i < path.between.size(); ++i) {
    const Vector6d misfit = RelativePoseResidual(path.RelativePose(i), states[i].map_T_imu,
                                                 states[i + 1].map_T_imu, nullptr, nullptr);
    const double way = misfit.head<3>().norm();
    const double turn = misfit.tail<3>().norm();
    const double sigmas =
        std::max(way / options.start.way_sigma_m, turn / options.start.turn_sigma_rad);
    if (sigmas <= options.start.misfit_sigma_max) continue;
    return NotYet(
        unit, absl::StrCat("from ", path.between[i]->from_ns(), " to ", path.between[i]->to_ns(),
                           " ns the cameras moved ", way, " m and turned ", turn,
                           " rad otherwise than the unit, ", sigmas, " standard deviations; up to ",
                           options.start.misfit_sigma_max, " are chance",
                           FaultTexts(path, unit, options)));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<AlignedPath> AlignInMotion(std::span<const Pose3d> start_T_imu,
                                          std::span<Preintegration* const> between,
                                          const ImuCalibration& calibration, double yaw_rad,
                                          const InertialOptions& options) {
  DSG_RETURN_IF_ERROR(calibration.Validate());
  PathMeasurements path = {start_T_imu, between, Vector3d::Zero()};
  DSG_RETURN_IF_ERROR(CheckPath(path, calibration, options));
  path.known_accel_bias = between.front()->bias().accel_m_s2;

  DSG_ASSIGN_OR_RETURN(const ImuBias bias, FitGyroBias(path, options));
  DSG_RETURN_IF_ERROR(CheckTurns(path, calibration, bias, options));
  const FreePath free = FitFreePath(path, bias, options);
  DSG_RETURN_IF_ERROR(CheckGravity(path, calibration, free, options));

  AlignedPath aligned;
  aligned.free_gravity_m_s2 = free.gravity.norm();
  aligned.states = StatesOf(path, bias, free);
  if (!FitPath(path, yaw_rad, options, &aligned.states, &aligned.last.covariance)) {
    return NotYet(calibration, absl::StrCat("the states of ", start_T_imu.size(),
                                            " keyframes do not follow from what was measured; "
                                            "wait for more"));
  }
  DSG_RETURN_IF_ERROR(CheckFit(path, calibration, aligned.states, options));
  aligned.last.state = aligned.states.back();
  return aligned;
}

}  // namespace dsg::ingest
