// SPDX-License-Identifier: Apache-2.0
#include "ingest/solver/pose_block.h"

#include <ceres/manifold.h>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseBlockSize; }
  int TangentSize() const override { return kPoseStepSize; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    WritePoseBlock(Stepped(PoseOfBlock(x), Eigen::Map<const Vector6d>(delta)), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>{y_minus_x} = StepBetween(PoseOfBlock(x), PoseOfBlock(y));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

}  // namespace

Pose3d PoseOfBlock(const double* block) {
  return {Eigen::Vector3d(block[0], block[1], block[2]),
          Eigen::Quaterniond(block[6], block[3], block[4], block[5])};
}

void WritePoseBlock(const Pose3d& pose, double* block) {
  Eigen::Map<Eigen::Vector3d>{block} = pose.position;
  Eigen::Map<Eigen::Vector4d>{block + 3} = pose.orientation.coeffs();
}

Pose3d Stepped(const Pose3d& pose, const Vector6d& step) {
  return {pose.position + step.head<3>(),
          (pose.orientation * RotationOf(step.tail<3>())).normalized()};
}

Vector6d StepBetween(const Pose3d& from, const Pose3d& to) {
  Vector6d step;
  step.head<3>() = to.position - from.position;
  step.tail<3>() = RotationVectorOf(from.orientation.conjugate() * to.orientation);
  return step;
}

std::unique_ptr<ceres::Manifold> MakePoseManifold() { return std::make_unique<PoseManifold>(); }

}  // namespace dsg::ingest
