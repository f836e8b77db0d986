// SPDX-License-Identifier: Apache-2.0
// People of known joints before known cameras, and the detections that a perfect network makes.
// Refuses to err; the tests add the noise they need.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"
#include "schema/base/random.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

using Joints = std::array<Eigen::Vector3d, kJointCount>;

/// Upright, arms hanging; pelvis in the origin, 0.93 m above the soles; x forward, y left, z up.
inline Joints StandingJoints() {
  Joints joints;
  joints[0] = {0, 0, 0};
  const auto both = [&](size_t left, double x, double y, double z) {
    joints[left] = {x, y, z};
    joints[left + 1] = {x, -y, z};
  };
  both(1, 0, 0.09, -0.07);
  joints[3] = {-0.01, 0, 0.11};
  both(4, 0.0, 0.09, -0.47);
  joints[6] = {-0.01, 0, 0.24};
  both(7, -0.01, 0.09, -0.85);
  joints[9] = {-0.01, 0, 0.30};
  both(10, 0.12, 0.1, -0.90);
  joints[12] = {-0.01, 0, 0.51};
  both(13, -0.01, 0.07, 0.42);
  joints[15] = {0, 0, 0.60};
  both(16, -0.01, 0.185, 0.44);
  both(18, -0.01, 0.215, 0.165);
  both(20, 0, 0.215, -0.085);
  both(22, 0.01, 0.215, -0.17);
  return joints;
}
inline constexpr double kSolesBelowPelvisM = 0.9275;

inline CameraCalibration TestCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.fx = camera.fy = 415.0;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}

/// At `height_m` over the map's origin, looking along x, `down_rad` below the horizon.
inline Pose3d LookAlongX(double height_m, double down_rad = 0.0) {
  Eigen::Matrix3d axes;
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Pose3d map_T_camera;
  map_T_camera.position = {0, 0, height_m};
  map_T_camera.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(down_rad, Eigen::Vector3d::UnitY())) *
      Eigen::Quaterniond(axes);
  return map_T_camera;
}

inline Pose3d Upright(const Eigen::Vector3d& position, double heading_rad) {
  return {position, Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()))};
}

/// What a network without faults says: everything seen, the box about joints, soles and head.
inline HumanDetection PerfectDetection(const CameraCalibration& camera, const Pose3d& map_T_camera,
                                       const Pose3d& map_T_torso,
                                       const Joints& joints = StandingJoints()) {
  HumanDetection detection;
  detection.id = 7;
  detection.camera = camera.name;
  detection.score = 0.9;
  const Pose3d camera_T_torso = map_T_camera.Inverse() * map_T_torso;
  Eigen::AlignedBox2d box;
  for (size_t j = 0; j < joints.size(); ++j) {
    detection.joints_root[j] = camera_T_torso.orientation * joints[j];
    detection.joints_px[j] = Project(camera, camera_T_torso * joints[j]);
    detection.joint_visibility[j] = 1.0;
    box.extend(detection.joints_px[j]);
  }
  box.extend(Project(camera, camera_T_torso * Eigen::Vector3d(0, 0, -kSolesBelowPelvisM)));
  box.extend(Project(camera, camera_T_torso * (joints[15] + Eigen::Vector3d(0, 0, 0.17))));
  detection.box_px << box.min(), box.max();
  const Eigen::AngleAxisd turn(camera_T_torso.orientation);
  for (int i = 0; i < 72; ++i) {
    detection.pose_coefficients.push_back(i < 3 ? static_cast<float>(turn.angle() * turn.axis()[i])
                                                : 0.0f);
  }
  detection.crop_center_px = box.center();
  detection.crop_px = 1.2 * box.sizes().maxCoeff();
  detection.weak_scale = 2.0 * camera.fx / (detection.crop_px * camera_T_torso.position.z());
  detection.weak_translation = (detection.joints_px[0] - detection.crop_center_px) /
                               (0.5 * detection.weak_scale * detection.crop_px);
  return detection;
}

}  // namespace dsg::ingest
