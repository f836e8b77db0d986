// SPDX-License-Identifier: Apache-2.0
// All states of a short path together: inertial integrations and poses relative to each other, by
// Gauss-Newton on dense normal equations.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/inertial/preintegration.h"

namespace dsg::ingest {

struct PathMeasurements {
  /// At keyframes.
  std::span<const Pose3d> start_T_imu;
  /// From each keyframe to the next.
  std::span<Preintegration* const> between;
  /// At the first keyframe, within options.rest_accel_bias_sigma.
  Eigen::Vector3d known_accel_bias = Eigen::Vector3d::Zero();

  /// Of the keyframe after the i-th in the frame of the i-th.
  Pose3d RelativePose(size_t i) const;
};

/// How the relative pose of two states differs from the cameras': position, then rotation, in the
/// frame of the first and of the second. Derivatives by a step of each pose; both or none.
Vector6d RelativePoseResidual(const Pose3d& from_T_to, const Pose3d& map_T_from,
                              const Pose3d& map_T_to, Matrix6d* by_from, Matrix6d* by_to);

/// Turns the map about the vertical and moves it, so that the last state is at the origin, upright
/// by the shortest turn and then turned by a yaw.
void AnchorAtLast(double yaw_rad, std::vector<InertialState>* states);

/// `states` are near the solution and become it, anchored at the last one; `last_covariance` is
/// that of the last state. False, and neither is of use, if the equations have no solution.
bool FitPath(const PathMeasurements& path, double yaw_rad, const InertialOptions& options,
             std::vector<InertialState>* states, Matrix15d* last_covariance);

}  // namespace dsg::ingest
