// SPDX-License-Identifier: Apache-2.0
#include "schema/model/rotation.h"

#include <cmath>

namespace dsg {
namespace {

// Below this angle the series is exact to rounding.
constexpr double kSmallAngle = 1e-4;

}  // namespace

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return cross;
}

Eigen::Quaterniond RotationOf(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  const double share =
      angle < kSmallAngle ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Eigen::Vector3d part = share * vector;
  return {std::cos(0.5 * angle), part.x(), part.y(), part.z()};
}

Eigen::Vector3d RotationVectorOf(const Eigen::Quaterniond& rotation) {
  // q and -q are one rotation; the one with w >= 0 turns by at most pi.
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d part = sign * rotation.vec();
  const double sine = part.norm();
  if (sine < kSmallAngle) return (2.0 + sine * sine / 3.0) * part;
  return 2.0 * std::atan2(sine, sign * rotation.w()) / sine * part;
}

Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  const Eigen::Matrix3d cross = CrossMatrix(vector);
  if (angle < kSmallAngle) {
    return Eigen::Matrix3d::Identity() - 0.5 * cross + cross * cross / 6.0;
  }
  // 1 - cos loses digits that the sine of half the angle keeps.
  const double half_sine = std::sin(0.5 * angle);
  const double square = angle * angle;
  return Eigen::Matrix3d::Identity() - 2.0 * half_sine * half_sine / square * cross +
         (angle - std::sin(angle)) / (square * angle) * cross * cross;
}

Eigen::Matrix3d InverseRightJacobian(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  const Eigen::Matrix3d cross = CrossMatrix(vector);
  const double square_share =
      angle < kSmallAngle
          ? 1.0 / 12.0
          : 1.0 / (angle * angle) - std::cos(0.5 * angle) / (2.0 * angle * std::sin(0.5 * angle));
  return Eigen::Matrix3d::Identity() + 0.5 * cross + square_share * cross * cross;
}

}  // namespace dsg
