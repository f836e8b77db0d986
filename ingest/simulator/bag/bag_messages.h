// SPDX-License-Identifier: Apache-2.0
// Measurements and calibration as the ROS messages of a sensor bag.
// Refuses to write them.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/simulator/bag/ros_messages.h"

namespace dsg::simulator {

/// The frames of a bag: the cameras hang on the body, the body moves in the world.
inline constexpr char kWorldFrame[] = "world";
inline constexpr char kBodyFrame[] = "base_link_gt";
inline constexpr char kLeftFrame[] = "left_cam";
inline constexpr char kRightFrame[] = "right_cam";

ros_messages::Imu ToImu(const ingest::ImuMeasurement& imu);
ros_messages::Odometry ToOdometry(const Pose3d& map_T_body);
ros_messages::TransformStamped ToTransform(const Pose3d& body_T_camera, const std::string& frame);

/// "mono8", "rgb8", "mono16", or "32FC1" for depth of either kind, in metres.
ros_messages::Image ToImage(const ingest::Image& image);

/// `baseline_m`: how far the camera is to the right of the left one, 0 for the left one.
ros_messages::CameraInfo ToCameraInfo(const ingest::CameraCalibration& camera, double baseline_m);

}  // namespace dsg::simulator
