// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_factors.h"

#include <Eigen/Cholesky>

namespace dsg::ingest {

Covariance6 BlockCovariance(const Eigen::Matrix3d& position, const Eigen::Matrix3d& turn) {
  Eigen::Matrix<double, 6, 6> whole = Eigen::Matrix<double, 6, 6>::Zero();
  whole.topLeftCorner<3, 3>() = position;
  whole.bottomRightCorner<3, 3>() = turn;
  Covariance6 triangle{};
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      triangle[next++] = static_cast<float>(whole(row, column));
    }
  }
  return triangle;
}

PoseFactor DetectionFactor(TimeNs time_ns, const Pose3d& map_T_torso,
                           const Eigen::Matrix3d& position_covariance_map, double heading_sigma_rad,
                           double tilt_sigma_rad) {
  PoseFactor factor;
  factor.type = "detection_prior";
  factor.from_ns = factor.to_ns = time_ns;
  factor.relative_pose = map_T_torso;
  const Eigen::Matrix3d position = position_covariance_map.llt().solve(Eigen::Matrix3d::Identity());
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  if (heading_sigma_rad > 0.0) {
    const Eigen::Vector3d sigma_rad(tilt_sigma_rad, tilt_sigma_rad, heading_sigma_rad);
    turn = sigma_rad.cwiseAbs2().cwiseInverse();
  }
  factor.information = BlockCovariance(position, turn.asDiagonal());
  return factor;
}

PoseFactor LinkFactor(const char* type, TimeNs from_ns, TimeNs to_ns, const Pose3d& step,
                      const Eigen::Vector3d& position_variance,
                      const Eigen::Vector3d& turn_information) {
  PoseFactor factor;
  factor.type = type;
  factor.from_ns = from_ns;
  factor.to_ns = to_ns;
  factor.relative_pose = step;
  const Eigen::Matrix3d position = position_variance.cwiseInverse().asDiagonal();
  factor.information = BlockCovariance(position, turn_information.asDiagonal());
  return factor;
}

}  // namespace dsg::ingest
