// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/rigid_refine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace dsg {
namespace {

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return cross;
}

// Of a predicted target: columns are the free turns, the shift and, last, the scale when free.
Eigen::Matrix3Xd Jacobian(const Eigen::Vector3d& source, const Motion& motion,
                          const MotionKind& kind) {
  const int turn_count = kind.is_upright ? 1 : 3;
  Eigen::Matrix3Xd jacobian(3, turn_count + 3 + (kind.is_scaled ? 1 : 0));
  const Eigen::Matrix3d turn = -motion.scale * motion.rotation * CrossMatrix(source);
  jacobian.leftCols(turn_count) = turn.rightCols(turn_count);
  jacobian.middleCols<3>(turn_count) = Eigen::Matrix3d::Identity();
  if (kind.is_scaled) jacobian.rightCols<1>() = motion.rotation * source;
  return jacobian;
}

}  // namespace

Motion FitMotion(const Columns& sources, const Columns& targets, const MotionKind& kind,
                 double scale) {
  Motion motion;
  motion.scale = scale;
  const Eigen::Vector3d source_mean = sources.rowwise().mean();
  const Eigen::Vector3d target_mean = targets.rowwise().mean();
  const Columns a = sources.colwise() - source_mean;
  const Columns b = targets.colwise() - target_mean;
  motion.rotation = WeightedRotation(a, b, Eigen::VectorXd::Ones(a.cols()), kind.is_upright);
  if (kind.is_scaled && a.squaredNorm() > 0.0) {
    const double fitted = (motion.rotation * a).cwiseProduct(b).sum() / a.squaredNorm();
    if (fitted > 0.0) motion.scale = fitted;
  }
  motion.translation = target_mean - motion.scale * (motion.rotation * source_mean);
  return motion;
}

Eigen::Matrix<double, 6, 6> MotionCovariance(const Columns& sources, const Columns& targets,
                                             const Motion& motion, const MotionKind& kind) {
  const int turn_count = kind.is_upright ? 1 : 3;
  const int size = turn_count + 3 + (kind.is_scaled ? 1 : 0);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < sources.cols(); ++i) {
    const Eigen::Matrix3Xd jacobian = Jacobian(sources.col(i), motion, kind);
    information += jacobian.transpose() * jacobian;
  }
  const double freedom = static_cast<double>(std::max<Eigen::Index>(1, 3 * sources.cols() - size));
  const double variance = (targets - motion * sources).squaredNorm() / freedom;
  const Eigen::MatrixXd full =
      variance * information.completeOrthogonalDecomposition().pseudoInverse();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.bottomRightCorner(turn_count + 3, turn_count + 3) =
      full.topLeftCorner(turn_count + 3, turn_count + 3);
  return covariance;
}

double SpreadForRotation(const Columns& points, bool is_upright) {
  const Columns centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d scatter =
      centred * centred.transpose() / static_cast<double>(points.cols());
  if (is_upright) return std::sqrt(scatter(0, 0) + scatter(1, 1));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

std::vector<double> Misses(const Columns& sources, const Columns& targets, const Motion& motion) {
  const Eigen::VectorXd misses = (targets - motion * sources).colwise().norm().transpose();
  return {misses.begin(), misses.end()};
}

}  // namespace dsg
