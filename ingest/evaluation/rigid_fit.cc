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

Eigen::Quaterniond RotationOf(const Eigen::Matrix3d& covariance, Alignment alignment) {
  if (alignment == Alignment::kYaw) {
    // covariance(i, j) = sum target_i source_j.
    const double yaw =
        std::atan2(covariance(1, 0) - covariance(0, 1), covariance(0, 0) + covariance(1, 1));
    return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * sign * svd.matrixV().transpose()))
      .normalized();
}

}  // namespace

Pose3d FitRigid(const std::vector<Eigen::Vector3d>& source,
                const std::vector<Eigen::Vector3d>& target, Alignment alignment) {
  if (alignment == Alignment::kNone) return {};
  const Eigen::Vector3d source_mean = Mean(source);
  const Eigen::Vector3d target_mean = Mean(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < source.size(); ++i) {
    covariance += (target[i] - target_mean) * (source[i] - source_mean).transpose();
  }
  Pose3d target_T_source;
  target_T_source.orientation = RotationOf(covariance, alignment);
  target_T_source.position = target_mean - target_T_source.orientation * source_mean;
  return target_T_source;
}

}  // namespace dsg::evaluation
