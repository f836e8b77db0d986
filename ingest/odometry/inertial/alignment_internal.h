// SPDX-License-Identifier: Apache-2.0
// What a first state defines itself, at rest and in motion alike.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "ingest/sensor/calibration.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {

/// Of the origin and the yaw, m and rad. Not 0, so that solvers can invert the covariance.
inline constexpr double kOriginSigma = 1e-5;
inline constexpr double kYawSigma = 1e-3;

/// The orientation of a unit in the map: upright by the shortest turn, and then turned by a yaw.
inline Eigen::Quaterniond UprightOrientation(const Eigen::Vector3d& up_imu, double yaw_rad) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const auto upright = Eigen::Quaterniond::FromTwoVectors(up_imu, z);
  return (RotationOf(yaw_rad * z) * upright).normalized();
}

/// What is there does not tell; more may.
inline absl::Status NotYet(const ImuCalibration& unit, const std::string& what) {
  return absl::FailedPreconditionError(absl::StrCat(unit.name, ": ", what));
}

}  // namespace dsg::ingest
