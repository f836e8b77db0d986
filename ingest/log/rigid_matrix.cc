// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/rigid_matrix.h"

#include <Eigen/SVD>

#include "absl/strings/str_cat.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

// Matrices printed with two or three decimals still pass; scaled or sheared ones do not.
constexpr double kDeviationMax = 2e-2;

}  // namespace

absl::StatusOr<RigidMatrix> ToRigid(const Eigen::Matrix4d& matrix) {
  if (!matrix.allFinite()) return absl::InvalidArgumentError("a number is not finite");
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6) {
    return absl::InvalidArgumentError("the last row must be 0 0 0 1");
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation <= kDeviationMax) || rotation.determinant() < 0.0) {
    return absl::InvalidArgumentError(
        absl::StrCat("the first three columns are no rotation (determinant ",
                     rotation.determinant(), ", columns off by ", deviation, ")"));
  }
  if (matrix.topRightCorner<3, 1>().cwiseAbs().maxCoeff() > kCoordinateMaxM) {
    return absl::InvalidArgumentError("the position lies beyond all bounds; are the units metres?");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  RigidMatrix result;
  result.pose.position = matrix.topRightCorner<3, 1>();
  result.pose.orientation = Eigen::Quaterniond(nearest).normalized();
  result.deviation = deviation;
  return result;
}

}  // namespace dsg::ingest
