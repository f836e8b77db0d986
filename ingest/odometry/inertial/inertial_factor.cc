// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/inertial_factor.h"

#include <ceres/sized_cost_function.h>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class InertialFactor : public ceres::SizedCostFunction<15, kPoseBlockSize, kSpeedBlockSize,
                                                       kPoseBlockSize, kSpeedBlockSize> {
 public:
  InertialFactor(const Preintegration* measured, const Vector3d& gravity_map)
      : measured_(*measured), gravity_map_(gravity_map) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const InertialState from = StateOfBlocks(blocks[0], blocks[1]);
    const InertialState to = StateOfBlocks(blocks[2], blocks[3]);
    Eigen::Map<Vector15d> out(residuals);
    if (jacobians == nullptr) {
      out = measured_.whitening() *
            InertialResidual(measured_, from, to, gravity_map_, nullptr, nullptr);
      return true;
    }
    Matrix15d by_from;
    Matrix15d by_to;
    out = measured_.whitening() *
          InertialResidual(measured_, from, to, gravity_map_, &by_from, &by_to);
    for (size_t state = 0; state < 2; ++state) {
      const Matrix15d white = measured_.whitening() * (state == 0 ? by_from : by_to);
      if (double* pose = jacobians[2 * state]; pose != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 15, kPoseBlockSize, Eigen::RowMajor>> jacobian(pose);
        jacobian.leftCols<kPoseStepSize>() = white.leftCols<kPoseStepSize>();
        jacobian.col(kPoseStepSize).setZero();
      }
      if (double* speed = jacobians[2 * state + 1]; speed != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 15, kSpeedBlockSize, Eigen::RowMajor>>{speed} =
            white.rightCols<kSpeedBlockSize>();
      }
    }
    return true;
  }

 private:
  const Preintegration& measured_;
  const Vector3d gravity_map_;
};

}  // namespace

Vector15d InertialResidual(const Preintegration& measured, const InertialState& from,
                           const InertialState& to, const Vector3d& gravity_map, Matrix15d* by_from,
                           Matrix15d* by_to) {
  const double t = measured.duration_s();
  const ImuIncrement increment = measured.CorrectedFor(from.bias);
  const Matrix3d from_R_map = from.map_T_imu.orientation.conjugate().toRotationMatrix();
  // As the states have them: the increment of position and velocity, and the turn.
  const Vector3d way = from_R_map * (to.map_T_imu.position - from.map_T_imu.position -
                                     t * from.velocity_map - 0.5 * t * t * gravity_map);
  const Vector3d gain = from_R_map * (to.velocity_map - from.velocity_map - t * gravity_map);
  const Eigen::Quaterniond turn = from.map_T_imu.orientation.conjugate() * to.map_T_imu.orientation;
  const Eigen::Quaterniond rest = increment.rotation.conjugate() * turn;

  Vector15d residual;
  residual << way - increment.position, RotationVectorOf(rest), gain - increment.velocity,
      to.bias.gyro_rad_s - from.bias.gyro_rad_s, to.bias.accel_m_s2 - from.bias.accel_m_s2;
  if (by_from == nullptr || by_to == nullptr) return residual;

  const Matrix3d by_turn = InverseRightJacobian(residual.segment<3>(kRotationRow));
  const auto& by_bias = measured.bias_jacobian();
  by_to->setIdentity();
  by_to->block<3, 3>(kPositionRow, kPositionRow) = from_R_map;
  by_to->block<3, 3>(kRotationRow, kRotationRow) = by_turn;
  by_to->block<3, 3>(kVelocityRow, kVelocityRow) = from_R_map;

  *by_from = -Matrix15d::Identity();
  by_from->block<3, 3>(kPositionRow, kPositionRow) = -from_R_map;
  by_from->block<3, 3>(kPositionRow, kRotationRow) = CrossMatrix(way);
  by_from->block<3, 3>(kPositionRow, kVelocityRow) = -t * from_R_map;
  by_from->block<3, 6>(kPositionRow, kGyroBiasRow) = -by_bias.middleRows<3>(kPositionRow);
  by_from->block<3, 3>(kRotationRow, kRotationRow) = -by_turn * turn.conjugate().toRotationMatrix();
  // The increment's rotation is RotationOf(shift_turn) on the right of the integrated one.
  const Matrix3d turn_by_bias = by_bias.block<3, 3>(kRotationRow, 0);
  const Vector3d shift_turn = turn_by_bias * (from.bias.gyro_rad_s - measured.bias().gyro_rad_s);
  by_from->block<3, 3>(kRotationRow, kGyroBiasRow) =
      -by_turn * rest.conjugate().toRotationMatrix() * RightJacobian(shift_turn) * turn_by_bias;
  by_from->block<3, 3>(kVelocityRow, kRotationRow) = CrossMatrix(gain);
  by_from->block<3, 3>(kVelocityRow, kVelocityRow) = -from_R_map;
  by_from->block<3, 6>(kVelocityRow, kGyroBiasRow) = -by_bias.middleRows<3>(kVelocityRow);
  return residual;
}

std::unique_ptr<ceres::CostFunction> MakeInertialFactor(const Preintegration* measured,
                                                        const Vector3d& gravity_map) {
  return std::make_unique<InertialFactor>(measured, gravity_map);
}

}  // namespace dsg::ingest
