// SPDX-License-Identifier: Apache-2.0
// The rotation between two sets of vectors.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace dsg::ingest {

/// The rotation that takes vectors `second` nearest to `first`, by least squares, from the sum of
/// all first * second'. Vectors in one line leave a turn about it open.
/// Source: Kabsch, 1976; Arun, Huang and Blostein, 1987.
inline Eigen::Matrix3d RotationOfProducts(const Eigen::Matrix3d& products) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& u = svd.matrixU();
  const Eigen::Matrix3d& v = svd.matrixV();
  const Eigen::Vector3d signs(1.0, 1.0, u.determinant() * v.determinant() < 0.0 ? -1.0 : 1.0);
  return u * signs.asDiagonal() * v.transpose();
}

}  // namespace dsg::ingest
