// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/ros_messages.h"

#include <bit>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_record.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

// Reads on; past the end it gives zeros and remembers.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : rest_(bytes) {}

  std::string_view Bytes(uint64_t size) {
    if (size > rest_.size()) {
      is_cut_ = true;
      rest_ = {};
      return {};
    }
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  uint64_t Unsigned(size_t size) {
    const std::string_view bytes = Bytes(size);
    return bytes.size() == size ? LittleEndian(bytes, 0, size) : 0;
  }
  uint32_t U32() { return static_cast<uint32_t>(Unsigned(4)); }
  uint8_t U8() { return static_cast<uint8_t>(Unsigned(1)); }
  double F64() { return std::bit_cast<double>(Unsigned(8)); }
  std::string_view String() { return Bytes(U32()); }

  RosHeader Header() {
    U32();
    RosHeader header;
    const auto seconds = static_cast<TimeNs>(U32());
    const auto nanoseconds = static_cast<TimeNs>(U32());
    header.stamp_ns = seconds * kNsPerSecond + nanoseconds;
    header.frame_id = std::string(String());
    return header;
  }
  Eigen::Vector3d Vector3() {
    Eigen::Vector3d v;
    for (Eigen::Index i = 0; i < 3; ++i) v[i] = F64();
    return v;
  }
  Eigen::Vector4d Vector4() {
    Eigen::Vector4d v;
    for (Eigen::Index i = 0; i < 4; ++i) v[i] = F64();
    return v;
  }
  void SkipDoubles(uint64_t count) { Bytes(count * 8); }

  bool is_cut() const { return is_cut_; }
  size_t rest() const { return rest_.size(); }

 private:
  std::string_view rest_;
  bool is_cut_ = false;
};

absl::Status CheckEnd(const Cursor& cursor, const char* type, const std::string& origin) {
  if (cursor.is_cut()) {
    return MalformedFile(origin, absl::StrCat("the message is too short for ", type));
  }
  if (cursor.rest() != 0) {
    return MalformedFile(
        origin, absl::StrCat("the message is ", cursor.rest(), " bytes too long for ", type,
                             "; is the type another one?"));
  }
  return absl::OkStatus();
}

RosImage ReadImageHead(Cursor* cursor) {
  RosImage image;
  image.header = cursor->Header();
  image.height = cursor->U32();
  image.width = cursor->U32();
  image.encoding = std::string(cursor->String());
  image.is_big_endian = cursor->U8() != 0;
  image.step = cursor->U32();
  return image;
}

RosPose ReadTransform(Cursor* cursor) {
  RosPose pose;
  pose.header = cursor->Header();
  pose.child_frame_id = std::string(cursor->String());
  pose.position = cursor->Vector3();
  pose.xyzw = cursor->Vector4();
  return pose;
}

}  // namespace

absl::StatusOr<Pose3d> RosPose::ToPose(const std::string& origin) const {
  if (!position.allFinite() || !xyzw.allFinite() ||
      position.cwiseAbs().maxCoeff() > kCoordinateMaxM) {
    return MalformedFile(origin, "the pose holds a number that is not finite or beyond 2000 km");
  }
  if (std::abs(xyzw.norm() - 1.0) > kQuaternionNormTolerance) {
    return MalformedFile(origin,
                         absl::StrCat("the quaternion's norm is ", xyzw.norm(), ", 1 is due"));
  }
  Pose3d pose;
  pose.position = position;
  pose.orientation = Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
  return pose;
}

absl::StatusOr<RosHeader> ParseRosHeader(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosHeader header = cursor.Header();
  if (cursor.is_cut()) return MalformedFile(origin, "the message is too short for a header");
  return header;
}

absl::StatusOr<RosImage> ParseRosImageHead(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosImage image = ReadImageHead(&cursor);
  if (cursor.is_cut()) {
    return MalformedFile(origin, "the message is too short for sensor_msgs/Image");
  }
  return image;
}

absl::StatusOr<RosImage> ParseRosImage(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosImage image = ReadImageHead(&cursor);
  image.data = cursor.String();
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "sensor_msgs/Image", origin));
  return image;
}

absl::StatusOr<RosCompressedImage> ParseRosCompressedImage(std::string_view bytes,
                                                           const std::string& origin) {
  Cursor cursor(bytes);
  RosCompressedImage image;
  image.header = cursor.Header();
  image.format = std::string(cursor.String());
  image.data = cursor.String();
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "sensor_msgs/CompressedImage", origin));
  return image;
}

absl::StatusOr<RosCameraInfo> ParseRosCameraInfo(std::string_view bytes,
                                                 const std::string& origin) {
  Cursor cursor(bytes);
  RosCameraInfo info;
  info.header = cursor.Header();
  info.height = cursor.U32();
  info.width = cursor.U32();
  info.distortion_model = std::string(cursor.String());
  const uint32_t count = cursor.U32();
  if (count > cursor.rest() / 8) {
    return MalformedFile(origin,
                         absl::StrCat("sensor_msgs/CameraInfo claims ", count, " coefficients"));
  }
  for (uint32_t i = 0; i < count; ++i) info.d.push_back(cursor.F64());
  for (double& value : info.k) value = cursor.F64();
  for (double& value : info.r) value = cursor.F64();
  for (double& value : info.p) value = cursor.F64();
  // Binning x and y; region of interest: x, y, height, width, whether to rectify.
  cursor.Bytes(2 * 4 + 4 * 4 + 1);
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "sensor_msgs/CameraInfo", origin));
  return info;
}

absl::StatusOr<RosImu> ParseRosImu(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosImu imu;
  imu.header = cursor.Header();
  cursor.SkipDoubles(4 + 9);
  imu.angular_velocity = cursor.Vector3();
  cursor.SkipDoubles(9);
  imu.acceleration = cursor.Vector3();
  cursor.SkipDoubles(9);
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "sensor_msgs/Imu", origin));
  if (!imu.angular_velocity.allFinite() || !imu.acceleration.allFinite()) {
    return MalformedFile(origin, "the inertial sample holds a number that is not finite");
  }
  return imu;
}

absl::StatusOr<RosPose> ParseRosOdometry(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosPose pose = ReadTransform(&cursor);
  // Covariance of the pose; the velocities and theirs.
  cursor.SkipDoubles(36 + 6 + 36);
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "nav_msgs/Odometry", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosPoseStamped(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosPose pose;
  pose.header = cursor.Header();
  pose.position = cursor.Vector3();
  pose.xyzw = cursor.Vector4();
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "geometry_msgs/PoseStamped", origin));
  return pose;
}

absl::StatusOr<RosPose> ParseRosTransform(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  RosPose pose = ReadTransform(&cursor);
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "geometry_msgs/TransformStamped", origin));
  return pose;
}

absl::StatusOr<std::vector<RosPose>> ParseRosTransforms(std::string_view bytes,
                                                        const std::string& origin) {
  Cursor cursor(bytes);
  std::vector<RosPose> poses;
  const uint32_t count = cursor.U32();
  for (uint32_t i = 0; i < count && !cursor.is_cut(); ++i) {
    poses.push_back(ReadTransform(&cursor));
  }
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "tf2_msgs/TFMessage", origin));
  return poses;
}

absl::StatusOr<std::string_view> ParseRosString(std::string_view bytes, const std::string& origin) {
  Cursor cursor(bytes);
  const std::string_view text = cursor.String();
  DSG_RETURN_IF_ERROR(CheckEnd(cursor, "std_msgs/String", origin));
  return text;
}

}  // namespace dsg::ingest
