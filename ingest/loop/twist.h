// SPDX-License-Identifier: Apache-2.0
// Small motions of poses as six numbers, translation before rotation, and how they change frames.
// Refuses to optimise.
#pragma once

#include <Eigen/Core>

#include "ingest/loop/pose_graph.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// The twist whose exponential is the pose; rotations up to pi.
Vector6d LogOf(const Pose3d& pose);

/// A twist of frame b, as a twist of frame a.
Matrix6d AdjointOf(const Pose3d& a_T_b);

/// `adjoint` covariance `adjoint`'.
Matrix6d MovedCovariance(const Matrix6d& adjoint, const Matrix6d& covariance);

/// Inverse of a symmetric positive definite matrix; of a planar one, in the rows and columns of x,
/// y and yaw, zeros elsewhere. Errors: zeros everywhere when it is not positive definite.
Matrix6d InverseOf(const Matrix6d& matrix, bool is_planar);

/// Inverse of an edge's information: of a twist in the frame of its pose `to`.
Matrix6d CovarianceOf(const RelativePose& edge, bool is_planar);

/// Mahalanobis distance of a twist and the spread it is measured by.
struct Deviation {
  double squared = 0.0;
  /// Square root of the covariance's determinant, of the 6 or 3 degrees of freedom.
  double volume = 0.0;
};
/// Directions that a planar graph has not are left out. Not positive definite: no deviation, and a
/// volume without end.
Deviation DeviationOf(const Vector6d& twist, const Matrix6d& covariance, bool is_planar);

}  // namespace dsg::ingest
