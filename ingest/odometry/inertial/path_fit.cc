// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/path_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "ingest/odometry/inertial/alignment_internal.h"
#include "ingest/odometry/inertial/inertial_factor.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Eigen::Index kStateStepSize = 15;

// Half of a sum of squares around some states, to second order in their steps.
struct NormalEquations {
  explicit NormalEquations(Eigen::Index size)
      : hessian(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}

  // Weighted rows of neighbouring columns, from `first` on.
  void AddRows(Eigen::Index first, const Eigen::MatrixXd& jacobian,
               const Eigen::VectorXd& residual) {
    const Eigen::Index size = jacobian.cols();
    hessian.block(first, first, size, size).noalias() += jacobian.transpose() * jacobian;
    gradient.segment(first, size).noalias() += jacobian.transpose() * residual;
  }

  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
};

// What the map defines itself: the last state's position and yaw, where they are now.
void AddAnchor(const InertialState& last, NormalEquations* equations) {
  const Eigen::Index first = equations->gradient.size() - kStateStepSize;
  const Vector3d up_imu = last.map_T_imu.orientation.conjugate() * Vector3d::UnitZ();
  equations->AddRows(first + kPositionRow, Matrix3d::Identity() / kOriginSigma, Vector3d::Zero());
  equations->AddRows(first + kRotationRow, up_imu.transpose() / kYawSigma,
                     Eigen::VectorXd::Zero(1));
}

NormalEquations EquationsAt(const PathMeasurements& path, const std::vector<InertialState>& states,
                            const InertialOptions& options) {
  NormalEquations equations(kStateStepSize * std::ssize(states));
  Vector6d pose_weights;
  pose_weights << Vector3d::Constant(1.0 / options.start.way_sigma_m),
      Vector3d::Constant(1.0 / options.start.turn_sigma_rad);
  Matrix15d by_from;
  Matrix15d by_to;
  for (size_t i = 0; i + 1 < states.size(); ++i) {
    const Eigen::Index first = kStateStepSize * static_cast<Eigen::Index>(i);
    const Preintegration& measured = *path.between[i];
    const Vector15d inertial = InertialResidual(measured, states[i], states[i + 1],
                                                options.gravity_map(), &by_from, &by_to);
    Eigen::MatrixXd jacobian(15, 2 * kStateStepSize);
    jacobian << by_from, by_to;
    equations.AddRows(first, measured.whitening() * jacobian, measured.whitening() * inertial);

    Matrix6d pose_by_from;
    Matrix6d pose_by_to;
    const Vector6d seen = RelativePoseResidual(path.RelativePose(i), states[i].map_T_imu,
                                               states[i + 1].map_T_imu, &pose_by_from, &pose_by_to);
    jacobian.setZero(6, kStateStepSize + kPoseStepSize);
    jacobian.leftCols<kPoseStepSize>() = pose_by_from;
    jacobian.rightCols<kPoseStepSize>() = pose_by_to;
    equations.AddRows(first, pose_weights.asDiagonal() * jacobian, pose_weights.cwiseProduct(seen));
  }
  equations.AddRows(
      kAccelBiasRow, Matrix3d::Identity() / options.rest_accel_bias_sigma,
      (states.front().bias.accel_m_s2 - path.known_accel_bias) / options.rest_accel_bias_sigma);
  AddAnchor(states.back(), &equations);
  return equations;
}

}  // namespace

Pose3d PathMeasurements::RelativePose(size_t i) const {
  return start_T_imu[i].Inverse() * start_T_imu[i + 1];
}

Vector6d RelativePoseResidual(const Pose3d& from_T_to, const Pose3d& map_T_from,
                              const Pose3d& map_T_to, Matrix6d* by_from, Matrix6d* by_to) {
  const Pose3d now = map_T_from.Inverse() * map_T_to;
  Vector6d residual;
  residual << now.position - from_T_to.position,
      RotationVectorOf((from_T_to.orientation.conjugate() * now.orientation).normalized());
  if (by_from == nullptr || by_to == nullptr) return residual;
  const Matrix3d from_R_map = map_T_from.orientation.conjugate().toRotationMatrix();
  const Matrix3d by_turn = InverseRightJacobian(residual.tail<3>());
  by_from->setZero();
  by_from->block<3, 3>(0, 0) = -from_R_map;
  by_from->block<3, 3>(0, 3) = CrossMatrix(now.position);
  by_from->block<3, 3>(3, 3) = -by_turn * now.orientation.conjugate().toRotationMatrix();
  by_to->setZero();
  by_to->block<3, 3>(0, 0) = from_R_map;
  by_to->block<3, 3>(3, 3) = by_turn;
  return residual;
}

void AnchorAtLast(double yaw_rad, std::vector<InertialState>* states) {
  const Pose3d last = states->back().map_T_imu;
  const Vector3d up_imu = last.orientation.conjugate() * Vector3d::UnitZ();
  // About the vertical, since both are upright.
  const Eigen::Quaterniond turn =
      (UprightOrientation(up_imu, yaw_rad) * last.orientation.conjugate()).normalized();
  for (InertialState& state : *states) {
    state.map_T_imu.position = turn * (state.map_T_imu.position - last.position);
    state.map_T_imu.orientation = (turn * state.map_T_imu.orientation).normalized();
    state.velocity_map = turn * state.velocity_map;
  }
}

bool FitPath(const PathMeasurements& path, double yaw_rad, const InertialOptions& options,
             std::vector<InertialState>* states, Matrix15d* last_covariance) {
  for (int step = 0; step < options.start.step_count; ++step) {
    AnchorAtLast(yaw_rad, states);
    const NormalEquations equations = EquationsAt(path, *states, options);
    const Eigen::VectorXd steps = -equations.hessian.ldlt().solve(equations.gradient);
    if (!steps.allFinite()) return false;
    for (size_t i = 0; i < states->size(); ++i) {
      const Eigen::Index first = kStateStepSize * static_cast<Eigen::Index>(i);
      (*states)[i] = Stepped((*states)[i], Vector15d(steps.segment<kStateStepSize>(first)));
    }
  }
  AnchorAtLast(yaw_rad, states);
  const NormalEquations equations = EquationsAt(path, *states, options);
  const Eigen::Index size = equations.gradient.size();
  Eigen::MatrixXd last_columns = Eigen::MatrixXd::Zero(size, kStateStepSize);
  last_columns.bottomRows<kStateStepSize>().setIdentity();
  const Matrix15d covariance =
      equations.hessian.ldlt().solve(last_columns).bottomRows<kStateStepSize>();
  *last_covariance = 0.5 * (covariance + covariance.transpose());
  return last_covariance->allFinite() && last_covariance->llt().info() == Eigen::Success;
}

}  // namespace dsg::ingest
