// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/rigid_fit.h"

#include <Eigen/SVD>
#include <cmath>

namespace dsg::evaluation {
namespace {

Eigen::Vector3d Mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

struct Turn {
  Eigen::Quaterniond rotation;
  /// trace(D S); of kYaw 0.
  double stretch = 0.0;
};

// covariance(i, j) = sum target_i source_j.
Turn TurnOf(const Eigen::Matrix3d& covariance, Alignment alignment) {
  if (alignment == Alignment::kYaw) {
    const double yaw =
        std::atan2(covariance(1, 0) - covariance(0, 1), covariance(0, 0) + covariance(1, 1));
    return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  sign.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(rotation).normalized(), svd.singularValues().dot(sign)};
}

}  // namespace

Similarity FitSimilarity(const std::vector<Eigen::Vector3d>& source,
                         const std::vector<Eigen::Vector3d>& target, Alignment alignment) {
  if (alignment == Alignment::kNone) return {};
  const Eigen::Vector3d source_mean = Mean(source);
  const Eigen::Vector3d target_mean = Mean(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  for (size_t i = 0; i < source.size(); ++i) {
    covariance += (target[i] - target_mean) * (source[i] - source_mean).transpose();
    squares += (source[i] - source_mean).squaredNorm();
  }
  const Turn turn = TurnOf(covariance, alignment);
  Similarity fit;
  if (alignment == Alignment::kSim3 && squares > 0.0) fit.scale = turn.stretch / squares;
  fit.target_T_source.orientation = turn.rotation;
  fit.target_T_source.position = target_mean - fit.scale * (turn.rotation * source_mean);
  return fit;
}

Pose3d FitRigid(const std::vector<Eigen::Vector3d>& source,
                const std::vector<Eigen::Vector3d>& target, Alignment alignment) {
  return FitSimilarity(source, target, alignment).target_T_source;
}

}  // namespace dsg::evaluation
