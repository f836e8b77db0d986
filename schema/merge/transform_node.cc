// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/transform_node.h"

#include <algorithm>
#include <cmath>

namespace dsg::merge {
namespace {

// A product of unit quaternions drifts off the unit sphere by an ulp a factor.
Pose3d Moved(const Pose3d& map_T_other, const Pose3d& other_T_body) {
  Pose3d pose = map_T_other * other_T_body;
  pose.orientation.normalize();
  return pose;
}

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Matrix6 FromUpper(const Covariance6& upper) {
  Matrix6 full;
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      full(row, column) = full(column, row) = static_cast<double>(upper[next++]);
    }
  }
  return full;
}

Covariance6 ToUpper(const Matrix6& full) {
  Covariance6 upper{};
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      upper[next++] = static_cast<float>(full(row, column));
    }
  }
  return upper;
}

Covariance6 Turned(const Covariance6& covariance, const Eigen::Matrix3d& rotation) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = rotation;
  turn.bottomRightCorner<3, 3>() = rotation;
  return ToUpper(turn * FromUpper(covariance) * turn.transpose());
}

void TransformRegion(const Pose3d& map_T_other, double z_other, RegionInfo* region) {
  for (Eigen::Vector2d& corner : region->footprint_map) {
    corner = (map_T_other * Eigen::Vector3d(corner.x(), corner.y(), z_other)).head<2>();
  }
  region->z_min_m += map_T_other.position.z();
  region->z_max_m += map_T_other.position.z();
}

}  // namespace

double TiltOf(const Pose3d& map_T_other) {
  const Eigen::Vector3d up = map_T_other.orientation * Eigen::Vector3d::UnitZ();
  return std::atan2(up.head<2>().norm(), up.z());
}

void TransformNode(const Pose3d& map_T_other, Node* node) {
  const double z_other = node->map_T_node.position.z();
  node->map_T_node = Moved(map_T_other, node->map_T_node);
  if (node->object.has_value() && node->object->model.has_value()) {
    node->object->map_T_model = Moved(map_T_other, node->object->map_T_model);
  }
  if (node->structure.has_value() && !node->structure->plane_normal_map.isZero()) {
    const Eigen::Vector3d normal = map_T_other.orientation * node->structure->plane_normal_map;
    node->structure->plane_normal_map = normal;
    node->structure->plane_offset_m -= normal.dot(map_T_other.position);
  }
  if (node->region.has_value()) TransformRegion(map_T_other, z_other, &*node->region);
}

void TransformPose(const Pose3d& map_T_other, TimedPose* pose) {
  const bool has_orientation = (pose->flags & pose_flags::kNoOrientation) == 0;
  if (has_orientation) {
    pose->map_T_agent = Moved(map_T_other, pose->map_T_agent);
  } else {
    pose->map_T_agent.position = map_T_other * pose->map_T_agent.position;
  }
  if (pose->covariance != nullptr) {
    pose->covariance = std::make_shared<const Covariance6>(
        Turned(*pose->covariance, map_T_other.orientation.toRotationMatrix()));
  }
}

void TransformFactor(const Pose3d& map_T_other, PoseFactor* factor) {
  if (factor->from_ns == factor->to_ns && factor->to_agent.empty()) {
    factor->relative_pose = Moved(map_T_other, factor->relative_pose);
  }
}

void TransformMesh(const Pose3d& map_T_other, MeshBlock* block) {
  const Eigen::Matrix3d rotation = map_T_other.orientation.toRotationMatrix();
  for (Eigen::Vector3f& position : block->positions_map) {
    position = (rotation * position.cast<double>() + map_T_other.position).cast<float>();
  }
  for (Eigen::Vector3f& normal : block->normals_map) {
    normal = (rotation * normal.cast<double>()).cast<float>();
  }
}

}  // namespace dsg::merge
