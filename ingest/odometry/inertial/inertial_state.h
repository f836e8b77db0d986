// SPDX-License-Identifier: Apache-2.0
// What inertial odometry estimates of one instant, and the order of its 15 numbers in errors,
// Jacobians and covariances.
#pragma once

#include <Eigen/Core>

#include "ingest/solver/pose_block.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// What the unit reads too much, in its own frame.
struct ImuBias {
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

/// The frame "imu" is that of the inertial unit. The map's z axis points up.
struct InertialState {
  Pose3d map_T_imu;
  /// m/s.
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  ImuBias bias;
};

/// First rows of the five parts of a state's 15 numbers: position and rotation are the step of a
/// pose block, then velocity, m/s, and biases, rad/s and m/s^2.
inline constexpr int kPositionRow = 0;
inline constexpr int kRotationRow = 3;
inline constexpr int kVelocityRow = 6;
inline constexpr int kGyroBiasRow = 9;
inline constexpr int kAccelBiasRow = 12;

InertialState Stepped(const InertialState& state, const Vector15d& step);
/// The step that leads from one state to the other.
Vector15d StepBetween(const InertialState& from, const InertialState& to);

/// Numbers of the second parameter block of a state: velocity, gyro bias, accelerometer bias.
inline constexpr int kSpeedBlockSize = 9;

void WriteSpeedBlock(const InertialState& state, double* block);
InertialState StateOfBlocks(const double* pose_block, const double* speed_block);

}  // namespace dsg::ingest
