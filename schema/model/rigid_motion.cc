// SPDX-License-Identifier: Apache-2.0
#include "schema/model/rigid_motion.h"

#include <cmath>
#include <memory>

namespace dsg {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// A product of unit quaternions drifts off the unit sphere by an ulp per factor.
Pose3d Moved(const Pose3d& new_T_old, const Pose3d& old_T_body) {
  Pose3d pose = new_T_old * old_T_body;
  pose.orientation.normalize();
  return pose;
}

void TransformRegion(const Pose3d& new_T_old, const Eigen::Vector3d& position_old,
                     RegionInfo* region) {
  for (Eigen::Vector2d& corner : region->footprint_map) {
    const Eigen::Vector3d corner_old(corner.x(), corner.y(), position_old.z());
    corner = (new_T_old * corner_old).head<2>();
  }
  // Exactly new_T_old.position.z() for a turn about z.
  const double rise_m =
      new_T_old.position.z() + ((new_T_old.orientation * position_old).z() - position_old.z());
  region->z_min_m += rise_m;
  region->z_max_m += rise_m;
}

}  // namespace

double TiltOf(const Pose3d& new_T_old) {
  const Eigen::Vector3d up = new_T_old.orientation * Eigen::Vector3d::UnitZ();
  return std::atan2(up.head<2>().norm(), up.z());
}

void TransformNode(const Pose3d& new_T_old, Node* node) {
  if (node->region.has_value()) {
    TransformRegion(new_T_old, node->map_T_node.position, &*node->region);
  }
  node->map_T_node = Moved(new_T_old, node->map_T_node);
  if (node->object.has_value() && node->object->model.has_value()) {
    node->object->map_T_model = Moved(new_T_old, node->object->map_T_model);
  }
  if (node->structure.has_value() && !node->structure->plane_normal_map.isZero()) {
    StructureInfo& plane = *node->structure;
    plane.plane_normal_map = new_T_old.orientation * plane.plane_normal_map;
    plane.plane_offset_m -= plane.plane_normal_map.dot(new_T_old.position);
  }
}

void TransformPose(const Pose3d& new_T_old, TimedPose* pose) {
  if ((pose->flags & pose_flags::kNoOrientation) != 0) {
    pose->map_T_agent.position = new_T_old * pose->map_T_agent.position;
  } else {
    pose->map_T_agent = Moved(new_T_old, pose->map_T_agent);
  }
  if (pose->covariance != nullptr) {
    pose->covariance = std::make_shared<const Covariance6>(
        TransformCovariance(new_T_old.orientation, *pose->covariance));
  }
}

Covariance6 TransformCovariance(const Eigen::Quaterniond& new_R_old,
                                const Covariance6& covariance) {
  Matrix6 full;
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      full(row, column) = full(column, row) = static_cast<double>(covariance[next++]);
    }
  }
  Matrix6 turn = Matrix6::Identity();
  turn.topLeftCorner<3, 3>() = new_R_old.toRotationMatrix();
  full = (turn * full * turn.transpose()).eval();
  Covariance6 upper{};
  next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      upper[next++] = static_cast<float>(full(row, column));
    }
  }
  return upper;
}

void TransformFactor(const Pose3d& new_T_old, PoseFactor* factor) {
  if (factor->from_ns == factor->to_ns && factor->to_agent.empty()) {
    factor->relative_pose = Moved(new_T_old, factor->relative_pose);
    // The inverse of a covariance turns as the covariance, because turns are orthogonal.
    if (factor->information.has_value()) {
      factor->information = TransformCovariance(new_T_old.orientation, *factor->information);
    }
  }
}

void TransformMesh(const Pose3d& new_T_old, MeshBlock* block) {
  const Eigen::Matrix3d rotation = new_T_old.orientation.toRotationMatrix();
  for (Eigen::Vector3f& position : block->positions_map) {
    position = (rotation * position.cast<double>() + new_T_old.position).cast<float>();
  }
  for (Eigen::Vector3f& normal : block->normals_map) {
    normal = (rotation * normal.cast<double>()).cast<float>();
  }
}

}  // namespace dsg
