// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/twist.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

constexpr int kPlanarRows[3] = {0, 1, 5};
constexpr int kSpatialOnlyRows[3] = {2, 3, 4};

}  // namespace

Vector6d LogOf(const Pose3d& pose) {
  const Eigen::AngleAxisd turn(pose.orientation);
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  const double angle = turn.angle();
  // (1 - angle / 2 cot(angle / 2)) / angle^2, by its series where that loses its digits.
  const double factor = angle < 1e-3
                            ? 1.0 / 12.0 + angle * angle / 720.0
                            : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  const Eigen::Vector3d once = rotation.cross(pose.position);
  Vector6d twist;
  twist.head<3>() = pose.position - 0.5 * once + factor * rotation.cross(once);
  twist.tail<3>() = rotation;
  return twist;
}

Matrix6d AdjointOf(const Pose3d& a_T_b) {
  const Eigen::Matrix3d rotation = a_T_b.orientation.toRotationMatrix();
  Matrix6d adjoint;
  adjoint.topLeftCorner<3, 3>() = rotation;
  adjoint.topRightCorner<3, 3>() = CrossMatrix(a_T_b.position) * rotation;
  adjoint.bottomLeftCorner<3, 3>().setZero();
  adjoint.bottomRightCorner<3, 3>() = rotation;
  return adjoint;
}

Matrix6d MovedCovariance(const Matrix6d& adjoint, const Matrix6d& covariance) {
  return adjoint * covariance * adjoint.transpose();
}

Matrix6d InverseOf(const Matrix6d& matrix, bool is_planar) {
  Matrix6d inverse = Matrix6d::Zero();
  if (!is_planar) {
    const Eigen::LLT<Matrix6d> factor(matrix);
    if (factor.info() == Eigen::Success) inverse = factor.solve(Matrix6d::Identity());
    return inverse;
  }
  Eigen::Matrix3d block;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) block(i, j) = matrix(kPlanarRows[i], kPlanarRows[j]);
  }
  const Eigen::LLT<Eigen::Matrix3d> factor(block);
  if (factor.info() != Eigen::Success) return inverse;
  const Eigen::Matrix3d inverse_block = factor.solve(Eigen::Matrix3d::Identity());
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) inverse(kPlanarRows[i], kPlanarRows[j]) = inverse_block(i, j);
  }
  return inverse;
}

Matrix6d CovarianceOf(const RelativePose& edge, bool is_planar) {
  return InverseOf(edge.information, is_planar);
}

Deviation DeviationOf(const Vector6d& twist, const Matrix6d& covariance, bool is_planar) {
  Matrix6d spread = covariance;
  Vector6d offset = twist;
  if (is_planar) {
    for (const int row : kSpatialOnlyRows) {
      spread.row(row).setZero();
      spread.col(row).setZero();
      spread(row, row) = 1.0;
      offset(row) = 0.0;
    }
  }
  const Eigen::LLT<Matrix6d> factor(spread);
  if (factor.info() != Eigen::Success) return {0.0, std::numeric_limits<double>::infinity()};
  factor.matrixL().solveInPlace(offset);
  return {offset.squaredNorm(), factor.matrixLLT().diagonal().prod()};
}

}  // namespace dsg::ingest
