// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/ros_messages.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/ros_fields.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

RosImage ReadImageHead(RosFields* fields) {
  RosImage image;
  image.header = fields->Header();
  image.height = fields->U32();
  image.width = fields->U32();
  image.encoding = std::string(fields->String());
  image.is_big_endian = fields->U8() != 0;
  image.step = fields->U32();
  return image;
}

RosPose ReadTransform(RosFields* fields) {
  RosPose pose;
  pose.header = fields->Header();
  pose.child_frame_id = std::string(fields->String());
  pose.position = fields->Vector3();
  pose.xyzw = fields->Vector4();
  return pose;
}

}  // namespace

absl::StatusOr<Pose3d> RosPose::ToPose(const std::string& origin) const {
  if (!position.allFinite() || !xyzw.allFinite() ||
      position.cwiseAbs().maxCoeff() > kCoordinateMaxM) {
    return MalformedFile(origin, "the pose holds a number that is not finite or beyond 2000 km");
  }
  if (std::abs(xyzw.norm() - 1.0) > kQuaternionNormTolerance) {
    return MalformedFile(origin, absl::StrCat("the quaternion's norm is ", xyzw.norm(),
                                              ", 1 is due; correct or filter the log, or give "
                                              "--pose-file"));
  }
  Pose3d pose;
  pose.position = position;
  pose.orientation = Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
  return pose;
}

absl::StatusOr<RosHeader> ParseRosHeader(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosHeader header = fields.Header();
  DSG_RETURN_IF_ERROR(fields.NotCut("a header", origin));
  return header;
}

absl::StatusOr<RosImage> ParseRosImageHead(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosImage image = ReadImageHead(&fields);
  DSG_RETURN_IF_ERROR(fields.NotCut("sensor_msgs/Image", origin));
  return image;
}

absl::StatusOr<RosImage> ParseRosImage(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosImage image = ReadImageHead(&fields);
  image.data = fields.Bytes();
  DSG_RETURN_IF_ERROR(fields.End("sensor_msgs/Image", origin));
  return image;
}

absl::StatusOr<RosCompressedImage> ParseRosCompressedImage(const RosBytes& message,
                                                           const std::string& origin) {
  RosFields fields(message);
  RosCompressedImage image;
  image.header = fields.Header();
  image.format = std::string(fields.String());
  image.data = fields.Bytes();
  DSG_RETURN_IF_ERROR(fields.End("sensor_msgs/CompressedImage", origin));
  return image;
}

absl::StatusOr<RosCameraInfo> ParseRosCameraInfo(const RosBytes& message,
                                                 const std::string& origin) {
  RosFields fields(message);
  RosCameraInfo info;
  info.header = fields.Header();
  info.height = fields.U32();
  info.width = fields.U32();
  info.distortion_model = std::string(fields.String());
  const uint32_t count = fields.U32();
  if (count > fields.rest() / 8) {
    return MalformedFile(origin,
                         absl::StrCat("sensor_msgs/CameraInfo claims ", count, " coefficients"));
  }
  for (uint32_t i = 0; i < count; ++i) info.d.push_back(fields.F64());
  for (double& value : info.k) value = fields.F64();
  for (double& value : info.r) value = fields.F64();
  for (double& value : info.p) value = fields.F64();
  // Binning x and y; region of interest: x, y, height, width, whether to rectify.
  for (int i = 0; i < 2 + 4; ++i) fields.U32();
  fields.U8();
  DSG_RETURN_IF_ERROR(fields.End("sensor_msgs/CameraInfo", origin));
  return info;
}

absl::StatusOr<RosImu> ParseRosImu(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosImu imu;
  imu.header = fields.Header();
  fields.SkipDoubles(4 + 9);
  imu.angular_velocity = fields.Vector3();
  fields.SkipDoubles(9);
  imu.acceleration = fields.Vector3();
  fields.SkipDoubles(9);
  DSG_RETURN_IF_ERROR(fields.End("sensor_msgs/Imu", origin));
  if (!imu.angular_velocity.allFinite() || !imu.acceleration.allFinite()) {
    return MalformedFile(origin, "the inertial sample holds a number that is not finite");
  }
  return imu;
}

absl::StatusOr<RosPose> ParseRosOdometry(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosPose pose = ReadTransform(&fields);
  // Covariance of the pose; the velocities and theirs.
  fields.SkipDoubles(36 + 6 + 36);
  DSG_RETURN_IF_ERROR(fields.End("nav_msgs/Odometry", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosPoseStamped(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosPose pose;
  pose.header = fields.Header();
  pose.position = fields.Vector3();
  pose.xyzw = fields.Vector4();
  DSG_RETURN_IF_ERROR(fields.End("geometry_msgs/PoseStamped", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosPoseWithCovariance(const RosBytes& message,
                                                   const std::string& origin) {
  RosFields fields(message);
  RosPose pose;
  pose.header = fields.Header();
  pose.position = fields.Vector3();
  pose.xyzw = fields.Vector4();
  fields.SkipDoubles(36);
  DSG_RETURN_IF_ERROR(fields.End("geometry_msgs/PoseWithCovarianceStamped", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosTransform(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  RosPose pose = ReadTransform(&fields);
  DSG_RETURN_IF_ERROR(fields.End("geometry_msgs/TransformStamped", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosPoseOf(std::string_view type, const RosBytes& message,
                                       const std::string& origin) {
  if (type == "nav_msgs/Odometry") return ParseRosOdometry(message, origin);
  if (type == "geometry_msgs/PoseStamped") return ParseRosPoseStamped(message, origin);
  if (type == "geometry_msgs/PoseWithCovarianceStamped") {
    return ParseRosPoseWithCovariance(message, origin);
  }
  return ParseRosTransform(message, origin);
}

absl::StatusOr<std::vector<RosPose>> ParseRosTransforms(const RosBytes& message,
                                                        const std::string& origin) {
  RosFields fields(message);
  std::vector<RosPose> poses;
  const uint32_t count = fields.U32();
  for (uint32_t i = 0; i < count && !fields.is_cut(); ++i) {
    poses.push_back(ReadTransform(&fields));
  }
  DSG_RETURN_IF_ERROR(fields.End("tf2_msgs/TFMessage", origin));
  return poses;
}

absl::StatusOr<std::string_view> ParseRosString(const RosBytes& message,
                                                const std::string& origin) {
  RosFields fields(message);
  const std::string_view text = fields.String();
  DSG_RETURN_IF_ERROR(fields.End("std_msgs/String", origin));
  return text;
}

}  // namespace dsg::ingest
