// SPDX-License-Identifier: Apache-2.0
// How far two poses are from what was measured between them, with derivatives.
// Refuses to weigh measurements against each other: that is the solver's.
#pragma once

#include <Eigen/Core>

#include "ingest/loop/optimize.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// What stands in the rotation's rows of a residual; equal to first order.
enum class RotationError {
  /// The rotation vector (planar: the angle in [-pi, pi]).
  kVector,
  /// Twice the vector part of the quaternion (planar: twice the sine of half the angle).
  kTwiceSine,
};

RotationError RotationErrorOf(PoseObjective objective, bool is_planar);

/// The information that belongs to `objective` and its RotationError; planar: rows 0, 1 and 5.
Matrix6d InformationOf(const RelativePose& edge, bool is_planar, PoseObjective objective);

/// [R_z' (R_i' (t_j - t_i) - t_z); rotation error of R_z' R_i' R_j]. Derivatives by translation in
/// map axes and rotation on the right, of each pose; both or none.
Vector6d SpatialResidual(const Pose3d& from_T_to, const Pose3d& map_T_from, const Pose3d& map_T_to,
                         RotationError error, Matrix6d* by_from, Matrix6d* by_to);

/// x, y and yaw of a pose.
Eigen::Vector3d PlanarOf(const Pose3d& pose);
/// A pose of x, y and yaw at height `z_m`.
Pose3d FromPlanar(const Eigen::Vector3d& planar, double z_m);

/// As SpatialResidual, of x, y and yaw.
Eigen::Vector3d PlanarResidual(const Eigen::Vector3d& from_T_to, const Eigen::Vector3d& map_T_from,
                               const Eigen::Vector3d& map_T_to, RotationError error,
                               Eigen::Matrix3d* by_from, Eigen::Matrix3d* by_to);

/// Rows and columns 0, 1 and 5.
Eigen::Matrix3d PlanarBlock(const Matrix6d& matrix);

}  // namespace dsg::ingest
