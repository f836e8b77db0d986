// SPDX-License-Identifier: Apache-2.0
// What a human detector says about one person in one image, whichever network it is.
// Refuses to say who the person is, and where in the map.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "schema/base/time.h"

namespace dsg::ingest {

/// Joints in the order of SMPL (Loper et al., 2015): 0 pelvis, 1-2 hips, 3 spine, 4-5 knees,
/// 6 spine, 7-8 ankles, 9 spine, 10-11 feet, 12 neck, 13-14 collars, 15 head, 16-17 shoulders,
/// 18-19 elbows, 20-21 wrists, 22-23 hands; left before right.
inline constexpr int kJointCount = 24;
/// Axis times angle of each joint.
inline constexpr size_t kPoseCoefficientCount = 3 * kJointCount;
inline constexpr int kPelvis = 0;
inline constexpr int kLeftHand = 22;
inline constexpr int kRightHand = 23;
inline constexpr int kShapeCount = 10;

/// Source: RSS 2020, section III-A "Human nodes" (GraphCNN on each image's bounding boxes).
struct HumanDetection {
  TimeNs time_ns = 0;
  /// The camera's channel: "cam0".
  std::string camera;
  /// Unique in the log.
  int64_t id = 0;
  /// 0 to 1.
  double score = 0.0;
  /// Pixels: left, top, right, bottom.
  Eigen::Vector4d box_px = Eigen::Vector4d::Zero();
  /// Instance in the label image of the same stamp; 0 = unknown.
  int mask_instance = 0;
  /// False for detectors that give boxes only: then no field of joints says anything.
  bool has_joints = true;
  /// Minus the pelvis, axes of the camera, metres.
  std::array<Eigen::Vector3d, kJointCount> joints_root;
  /// Pixels.
  std::array<Eigen::Vector2d, kJointCount> joints_px;
  /// 0 hidden to 1 seen.
  std::array<double, kJointCount> joint_visibility{};
  /// Axis-angle of each joint against its parent, the pelvis against the camera, radians; 72
  /// numbers or none.
  std::vector<float> pose_coefficients;
  /// kShapeCount numbers or none.
  std::vector<float> shape_coefficients;
  /// x, y, z of each vertex of the body's mesh minus the pelvis, axes of the camera, metres; may be
  /// empty.
  std::vector<float> vertices_root;
  /// Where the pelvis is before the full camera, metres, from networks that say so; the weak camera
  /// says nothing then.
  std::optional<Eigen::Vector3d> pelvis_camera;
  /// x_px = crop centre + scale * (X + t) * crop_px / 2: the usual weak-perspective camera.
  double weak_scale = 0.0;
  Eigen::Vector2d weak_translation = Eigen::Vector2d::Zero();
  /// Centre and edge of the square crop, pixels.
  Eigen::Vector2d crop_center_px = Eigen::Vector2d::Zero();
  double crop_px = 0.0;
};

}  // namespace dsg::ingest
