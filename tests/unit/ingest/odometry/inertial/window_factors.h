// SPDX-License-Identifier: Apache-2.0
// Simple factors that windows of these tests have besides inertial ones.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>

#include "ingest/odometry/inertial/inertial_state.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {

/// The parameter blocks of a state.
struct StateBlocks {
  explicit StateBlocks(const InertialState& state) {
    WritePoseBlock(state.map_T_imu, pose.data());
    WriteSpeedBlock(state, speed.data());
  }
  InertialState state() const { return StateOfBlocks(pose.data(), speed.data()); }

  std::array<double, kPoseBlockSize> pose{};
  std::array<double, kSpeedBlockSize> speed{};
};

/// A pose is known, with standard deviations in metres and radians.
class PoseAnchor : public ceres::SizedCostFunction<6, kPoseBlockSize> {
 public:
  PoseAnchor(const Pose3d& pose, double sigma_m, double sigma_rad) : pose_(pose) {
    weights_ << Eigen::Vector3d::Constant(1.0 / sigma_m),
        Eigen::Vector3d::Constant(1.0 / sigma_rad);
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Vector6d step = StepBetween(pose_, PoseOfBlock(blocks[0]));
    Eigen::Map<Vector6d>{residuals} = weights_.cwiseProduct(step);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> jacobian(jacobians[0]);
    jacobian.setZero();
    jacobian.topLeftCorner<3, 3>().setIdentity();
    jacobian.block<3, 3>(3, 3) = InverseRightJacobian(step.tail<3>());
    jacobian = weights_.asDiagonal() * Eigen::Matrix<double, 6, 7>(jacobian);
    return true;
  }

 private:
  const Pose3d pose_;
  Vector6d weights_;
};

/// Rows of a speed block are known, from the first one on: 0 velocity and biases, 3 biases only.
class SpeedAnchor : public ceres::SizedCostFunction<9, kSpeedBlockSize> {
 public:
  SpeedAnchor(const InertialState& state, int first_row) {
    WriteSpeedBlock(state, value_.data());
    weights_ << Eigen::Vector3d::Constant(first_row == 0 ? 10.0 : 0.0),
        Eigen::Vector3d::Constant(100.0), Eigen::Vector3d::Constant(10.0);
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    Eigen::Map<Vector9d>{residuals} =
        weights_.cwiseProduct(Eigen::Map<const Vector9d>(blocks[0]) - value_);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 9, 9, Eigen::RowMajor>>{jacobians[0]} =
        Eigen::Matrix<double, 9, 9>(weights_.asDiagonal());
    return true;
  }

 private:
  Vector9d value_;
  Vector9d weights_;
};

/// A landmark was seen at a place in the frame of the pose, with 1 cm.
class PointFactor : public ceres::SizedCostFunction<3, kPoseBlockSize, 3> {
 public:
  explicit PointFactor(const Eigen::Vector3d& point_imu) : point_imu_(point_imu) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Pose3d pose = PoseOfBlock(blocks[0]);
    const Eigen::Matrix3d imu_R_map = pose.orientation.conjugate().toRotationMatrix();
    const Eigen::Vector3d seen = imu_R_map * (Eigen::Vector3d(blocks[1]) - pose.position);
    Eigen::Map<Eigen::Vector3d>{residuals} = kWeight * (seen - point_imu_);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> jacobian(jacobians[0]);
      jacobian << -kWeight * imu_R_map, kWeight * CrossMatrix(seen), Eigen::Vector3d::Zero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[1]} = kWeight * imu_R_map;
    }
    return true;
  }

 private:
  static constexpr double kWeight = 100.0;
  const Eigen::Vector3d point_imu_;
};

}  // namespace dsg::ingest
