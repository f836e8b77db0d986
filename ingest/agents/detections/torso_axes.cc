// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/torso_axes.h"

#include <algorithm>
#include <cmath>

#include "schema/model/geometry.h"

namespace dsg::ingest {
namespace {

constexpr int kLeftHip = 1;
constexpr int kRightHip = 2;
constexpr int kNeck = 12;
constexpr int kLeftShoulder = 16;
constexpr int kRightShoulder = 17;
// Skeletons without a trunk, or in another unit, have no axes.
constexpr double kLengthMinM = 0.02;
constexpr double kLengthMaxM = 10.0;

std::optional<Eigen::Quaterniond> FromJoints(const HumanDetection& detection) {
  if (!detection.has_joints) return std::nullopt;
  const auto& joints = detection.joints_root;
  const Eigen::Vector3d hips = 0.5 * (joints[kLeftHip] + joints[kRightHip]);
  const Eigen::Vector3d up = joints[kNeck] - hips;
  Eigen::Vector3d left =
      joints[kLeftHip] - joints[kRightHip] + joints[kLeftShoulder] - joints[kRightShoulder];
  if (!(up.norm() > kLengthMinM && up.norm() < kLengthMaxM)) return std::nullopt;
  left -= up * (up.dot(left) / up.squaredNorm());
  if (!(left.norm() > kLengthMinM && left.norm() < kLengthMaxM)) return std::nullopt;
  Eigen::Matrix3d axes;
  axes.col(1) = left.normalized();
  axes.col(2) = up.normalized();
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return Eigen::Quaterniond(axes);
}

std::optional<Eigen::Quaterniond> FromPose(const HumanDetection& detection) {
  if (detection.pose_coefficients.size() != kPoseCoefficientCount) return std::nullopt;
  const auto& pose = detection.pose_coefficients;
  const Eigen::Vector3d turn(pose[0], pose[1], pose[2]);
  if (!turn.allFinite()) return std::nullopt;
  const double angle = turn.norm();
  if (angle < 1e-9) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
}

// Columns: the torso's forward, left and up in SMPL's axes.
Eigen::Quaterniond SmplFromTorso() {
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  return Eigen::Quaterniond(axes);
}

}  // namespace

std::optional<TorsoAxes> FindTorsoAxes(const HumanDetection& detection,
                                       const PlacementOptions& options) {
  const std::optional<Eigen::Quaterniond> joints = FromJoints(detection);
  const std::optional<Eigen::Quaterniond> pose = FromPose(detection);
  if (!joints.has_value() && !pose.has_value()) return std::nullopt;
  const double hidden_rad = options.hidden_sigma_rad * (1.0 - MeanVisibility(detection));
  if (!pose.has_value()) return TorsoAxes{*joints, options.joint_sigma_rad + hidden_rad};
  Eigen::Quaterniond turned = *pose;
  const Eigen::Quaterniond smpl = *pose * SmplFromTorso();
  if (joints.has_value() && AngleBetween(smpl, *joints) < AngleBetween(*pose, *joints)) {
    turned = smpl;
  }
  return TorsoAxes{turned, options.pose_sigma_rad + hidden_rad};
}

double MeanVisibility(const HumanDetection& detection) {
  if (!detection.has_joints) return 1.0;
  double sum = 0.0;
  for (const double visibility : detection.joint_visibility) {
    if (visibility > 0.0) sum += std::min(visibility, 1.0);
  }
  return sum / kJointCount;
}

}  // namespace dsg::ingest
