// SPDX-License-Identifier: Apache-2.0
// One detection of a person, put into the map.
// Refuses to say who it is.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ingest/sensor/human_detection.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// What else an image says of where a torso is. Rank-deficient on purpose: a cue may know the
/// distance alone, or the height alone.
struct PositionCue {
  enum class Kind { kFloorContact, kDepthImage, kTorsoHeight };
  Kind kind = Kind::kFloorContact;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
  /// Positive semidefinite, 1 / m^2.
  Eigen::Matrix3d information_map = Eigen::Matrix3d::Zero();
};

/// Torso frame: origin at the pelvis of the standing body, x forward, z up.
struct PersonObservation {
  TimeNs time_ns = 0;
  int64_t detection_id = 0;
  /// Cut by the image's border: carries a track on, but never opens one.
  bool is_weak = false;
  /// As the detection alone has it.
  Pose3d map_T_torso;
  /// Of map_T_torso.position; long along the ray of the camera.
  Eigen::Matrix3d position_covariance_map = Eigen::Matrix3d::Identity();
  /// Of the heading; large when the detector gives none (no coefficients, no joints).
  double heading_sigma_rad = 0.35;
  bool has_heading = true;
  Eigen::Vector3d camera_map = Eigen::Vector3d::Zero();
  /// Independent of the detection's own depth; empty in the paper's literal mode.
  std::vector<PositionCue> cues;
  bool has_joints = false;
  /// Torso frame, metres.
  std::array<Eigen::Vector3d, kJointCount> joints_torso;
  std::array<double, kJointCount> joint_visibility{};
  /// As HumanDetection; may be empty.
  std::vector<float> pose_coefficients;
  std::vector<float> shape_coefficients;
  /// x, y, z of each vertex, torso frame, metres; may be empty.
  std::vector<float> vertices_torso;
};

}  // namespace dsg::ingest
