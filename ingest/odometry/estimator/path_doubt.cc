// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/path_doubt.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;

// How a point moves when all turns about the vertical at the origin, per radian.
Vector3d MovedByTurn(const Vector3d& point) { return Vector3d::UnitZ().cross(point); }

}  // namespace

void PathDoubt::Add(const Vector3d& position_map, double way_m, double turn_rad) {
  Matrix4d origin_by_place = Matrix4d::Identity();
  origin_by_place.topRightCorner<3, 1>() = -MovedByTurn(position_map);
  Matrix4d there = Matrix4d::Zero();
  there.diagonal() << way_m * way_m, way_m * way_m, way_m * way_m, turn_rad * turn_rad;
  covariance_ += origin_by_place * there * origin_by_place.transpose();
}

Matrix6d PathDoubt::At(const Pose3d& map_T_body) const {
  Eigen::Matrix<double, 6, 4> by_origin = Eigen::Matrix<double, 6, 4>::Zero();
  by_origin.topLeftCorner<3, 3>().setIdentity();
  by_origin.topRightCorner<3, 1>() = MovedByTurn(map_T_body.position);
  by_origin.bottomRightCorner<3, 1>() = map_T_body.orientation.conjugate() * Vector3d::UnitZ();
  return by_origin * covariance_ * by_origin.transpose();
}

}  // namespace dsg::ingest
