// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/bag_messages.h"

#include <bit>
#include <cstring>

namespace dsg::simulator {
namespace {

static_assert(std::endian::native == std::endian::little, "images are written as they stand");

template <class Vector>
void Set(const Eigen::Vector3d& from, Vector* to) {
  to->x = from.x();
  to->y = from.y();
  to->z = from.z();
}

template <class Quaternion>
void Set(const Eigen::Quaterniond& from, Quaternion* to) {
  to->x = from.x();
  to->y = from.y();
  to->z = from.z();
  to->w = from.w();
}

const char* Encoding(ingest::PixelFormat format) {
  switch (format) {
    case ingest::PixelFormat::kGray8:
      return "mono8";
    case ingest::PixelFormat::kRgb8:
      return "rgb8";
    case ingest::PixelFormat::kLabel16:
      return "mono16";
    case ingest::PixelFormat::kDepth16:
    case ingest::PixelFormat::kDepth32:
      return "32FC1";
    case ingest::PixelFormat::kPoints32:
      break;
  }
  return "";
}

// Millimetres, two bytes a pixel, as metres, four bytes a pixel.
template <class Bytes>
void CopyDepth(const ingest::Image& image, Bytes* bytes) {
  bytes->resize(image.bytes.size() * 2);
  size_t at = 0;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column, at += sizeof(float)) {
      const float depth_m = ingest::DepthAt(image, column, row);
      std::memcpy(&(*bytes)[at], &depth_m, sizeof(float));
    }
  }
}

}  // namespace

ros_messages::Imu ToImu(const ingest::ImuMeasurement& imu) {
  ros_messages::Imu message;
  message.header.frame_id = kBodyFrame;
  // An inertial unit has no orientation of its own; this is how sensor_msgs says so.
  message.orientation_covariance[0] = -1.0;
  Set(imu.angular_velocity_rad_s, &message.angular_velocity);
  Set(imu.acceleration_m_s2, &message.linear_acceleration);
  return message;
}

ros_messages::Odometry ToOdometry(const Pose3d& map_T_body) {
  ros_messages::Odometry message;
  message.header.frame_id = kWorldFrame;
  message.child_frame_id = kBodyFrame;
  Set(map_T_body.position, &message.pose.pose.position);
  Set(map_T_body.orientation, &message.pose.pose.orientation);
  return message;
}

ros_messages::TransformStamped ToTransform(const Pose3d& body_T_camera, const std::string& frame) {
  ros_messages::TransformStamped message;
  message.header.frame_id = kBodyFrame;
  message.child_frame_id = frame;
  Set(body_T_camera.position, &message.transform.translation);
  Set(body_T_camera.orientation, &message.transform.rotation);
  return message;
}

ros_messages::Image ToImage(const ingest::Image& image) {
  ros_messages::Image message;
  message.width = static_cast<uint32_t>(image.width);
  message.height = static_cast<uint32_t>(image.height);
  message.encoding = Encoding(image.format);
  if (image.format == ingest::PixelFormat::kDepth16) {
    CopyDepth(image, &message.data);
  } else {
    message.data.assign(image.bytes.begin(), image.bytes.end());
  }
  message.step =
      message.height == 0 ? 0 : static_cast<uint32_t>(message.data.size()) / message.height;
  return message;
}

ros_messages::CameraInfo ToCameraInfo(const ingest::CameraCalibration& camera, double baseline_m) {
  ros_messages::CameraInfo message;
  message.width = static_cast<uint32_t>(camera.width);
  message.height = static_cast<uint32_t>(camera.height);
  message.distortion_model =
      camera.distortion == ingest::Distortion::kEquidistant ? "equidistant" : "plumb_bob";
  message.D.assign(camera.distortion_coefficients.begin(), camera.distortion_coefficients.end());
  // "plumb_bob" has five coefficients, all zero without distortion.
  if (camera.distortion != ingest::Distortion::kEquidistant) message.D.resize(5, 0.0);
  message.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  message.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  message.P = {camera.fx, 0.0,       camera.cx, -camera.fx * baseline_m,
               0.0,       camera.fy, camera.cy, 0.0,
               0.0,       0.0,       1.0,       0.0};
  return message;
}

}  // namespace dsg::simulator
