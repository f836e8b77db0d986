// SPDX-License-Identifier: Apache-2.0
#include "schema/model/rotation.h"

#include <gtest/gtest.h>

#include <vector>

#include "schema/model/geometry.h"

namespace dsg {
namespace {

constexpr double kStep = 1e-6;

// From nothing to nearly half a circle, on both sides of where the series ends.
std::vector<Eigen::Vector3d> Vectors() {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.7, 0.5).normalized();
  std::vector<Eigen::Vector3d> vectors;
  for (const double angle : {0.0, 1e-9, 9.9e-5, 1.01e-4, 1e-3, 0.1, 1.0, 2.5, 3.1}) {
    vectors.emplace_back(angle * axis);
  }
  return vectors;
}

TEST(Rotation, IsThatOfAxisAndAngle) {
  for (const Eigen::Vector3d& vector : Vectors()) {
    if (vector.norm() == 0.0) continue;
    const Eigen::Quaterniond expected(
        Eigen::AngleAxisd(vector.norm(), Eigen::Vector3d(vector.normalized())));
    EXPECT_LT(AngleBetween(RotationOf(vector), expected), 1e-14) << vector.norm();
    EXPECT_NEAR(RotationOf(vector).norm(), 1.0, 1e-14);
  }
}

TEST(Rotation, VectorsComeBackFromEitherSignOfTheQuaternion) {
  for (const Eigen::Vector3d& vector : Vectors()) {
    const Eigen::Quaterniond rotation = RotationOf(vector);
    const Eigen::Quaterniond other(Eigen::Vector4d(-rotation.coeffs()));
    EXPECT_LT((RotationVectorOf(rotation) - vector).norm(), 1e-13) << vector.norm();
    EXPECT_LT((RotationVectorOf(other) - vector).norm(), 1e-13) << vector.norm();
  }
}

TEST(Rotation, LongVectorsTurnTheShortWay) {
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitY();
  EXPECT_LT((RotationVectorOf(RotationOf(4.0 * axis)) - (4.0 - 2.0 * M_PI) * axis).norm(), 1e-13);
}

TEST(Rotation, CrossMatrixIsTheProduct) {
  const Eigen::Vector3d a(1.0, 2.0, 3.0);
  const Eigen::Vector3d b(-0.5, 0.7, 2.0);
  const Eigen::Vector3d product = CrossMatrix(a) * b;
  EXPECT_LT((product - a.cross(b)).norm(), 1e-15);
}

TEST(Rotation, JacobiansAgreeWithDifferences) {
  for (const Eigen::Vector3d& vector : Vectors()) {
    const Eigen::Quaterniond rotation = RotationOf(vector);
    Eigen::Matrix3d right;
    Eigen::Matrix3d inverse;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
      const auto turned = [&](const Eigen::Vector3d& by) {
        return RotationVectorOf(rotation.conjugate() * RotationOf(vector + by));
      };
      right.col(i) = (turned(step) - turned(-step)) / (2.0 * kStep);
      inverse.col(i) = (RotationVectorOf(rotation * RotationOf(step)) -
                        RotationVectorOf(rotation * RotationOf(-step))) /
                       (2.0 * kStep);
    }
    EXPECT_LT((RightJacobian(vector) - right).norm(), 1e-8) << vector.norm();
    EXPECT_LT((InverseRightJacobian(vector) - inverse).norm(), 1e-7) << vector.norm();
    EXPECT_LT(
        (RightJacobian(vector) * InverseRightJacobian(vector) - Eigen::Matrix3d::Identity()).norm(),
        1e-10)
        << vector.norm();
  }
}

}  // namespace
}  // namespace dsg
