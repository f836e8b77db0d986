// SPDX-License-Identifier: Apache-2.0
// The ROS messages that sensor logs are made of, from their bytes.
// Refuses messages with bytes too few or too many: they would be of another definition.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// How messages become bytes: ROS 1's own way, or CDR of ROS 2.
enum class RosEncoding { kRos1, kCdr };

/// One message.
struct RosBytes {
  RosBytes() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): bytes alone are ROS 1's.
  RosBytes(std::string_view of_ros1) : bytes(of_ros1) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  RosBytes(const std::string& of_ros1) : bytes(of_ros1) {}
  RosBytes(std::string_view some, RosEncoding how) : bytes(some), encoding(how) {}

  std::string_view bytes;
  RosEncoding encoding = RosEncoding::kRos1;
};

struct RosHeader {
  TimeNs stamp_ns = 0;
  std::string frame_id;
};

/// sensor_msgs/Image. `data` is a view into the message.
struct RosImage {
  RosHeader header;
  uint32_t height = 0;
  uint32_t width = 0;
  std::string encoding;
  bool is_big_endian = false;
  /// Bytes from row to row.
  uint32_t step = 0;
  std::string_view data;
};

/// sensor_msgs/CompressedImage. `data` is a view into the message.
struct RosCompressedImage {
  RosHeader header;
  std::string format;
  std::string_view data;
};

/// sensor_msgs/CameraInfo, without binning and region of interest.
struct RosCameraInfo {
  RosHeader header;
  uint32_t height = 0;
  uint32_t width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
};

/// sensor_msgs/Imu, without orientation and covariances.
struct RosImu {
  RosHeader header;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

/// nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped or TransformStamped,
/// without velocities and covariances.
struct RosPose {
  RosHeader header;
  std::string child_frame_id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// x y z w, as found: unit only if the writer was right.
  Eigen::Vector4d xyzw = Eigen::Vector4d::Zero();

  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED when a number is not finite, too far, or the
  /// quaternion's norm is not within 1e-3 of 1.
  absl::StatusOr<Pose3d> ToPose(const std::string& origin) const;
};

/// The stamp and frame that a message begins with.
/// Errors of all: INVALID_ARGUMENT/FILE_MALFORMED naming `origin` and the type.
absl::StatusOr<RosHeader> ParseRosHeader(const RosBytes& message, const std::string& origin);
absl::StatusOr<RosImage> ParseRosImage(const RosBytes& message, const std::string& origin);
absl::StatusOr<RosCompressedImage> ParseRosCompressedImage(const RosBytes& message,
                                                           const std::string& origin);
absl::StatusOr<RosCameraInfo> ParseRosCameraInfo(const RosBytes& message,
                                                 const std::string& origin);
absl::StatusOr<RosImu> ParseRosImu(const RosBytes& message, const std::string& origin);
absl::StatusOr<RosPose> ParseRosOdometry(const RosBytes& message, const std::string& origin);
absl::StatusOr<RosPose> ParseRosPoseStamped(const RosBytes& message, const std::string& origin);
absl::StatusOr<RosPose> ParseRosPoseWithCovariance(const RosBytes& message,
                                                   const std::string& origin);
absl::StatusOr<RosPose> ParseRosTransform(const RosBytes& message, const std::string& origin);
/// Of the four types above, by name.
absl::StatusOr<RosPose> ParseRosPoseOf(std::string_view type, const RosBytes& message,
                                       const std::string& origin);
absl::StatusOr<std::vector<RosPose>> ParseRosTransforms(const RosBytes& message,
                                                        const std::string& origin);
/// A view into the message.
absl::StatusOr<std::string_view> ParseRosString(const RosBytes& message, const std::string& origin);

/// Reads an image's head from the message's first bytes, without its pixels.
absl::StatusOr<RosImage> ParseRosImageHead(const RosBytes& message, const std::string& origin);

}  // namespace dsg::ingest
