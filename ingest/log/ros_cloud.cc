// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/ros_cloud.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/image_file.h"
#include "ingest/log/point_row.h"
#include "ingest/log/ros_fields.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kType[] = "sensor_msgs/PointCloud2";
// Of sensor_msgs/PointField.
constexpr uint8_t kFloat32 = 7;
constexpr uint8_t kFloat64 = 8;
// Drivers have a dozen.
constexpr uint32_t kFieldsMax = 256;

struct PointField {
  uint32_t offset = 0;
  uint8_t datatype = 0;

  size_t byte_count() const { return datatype == kFloat64 ? 8 : 4; }
};

struct Cloud {
  uint32_t height = 0;
  uint32_t width = 0;
  std::array<std::optional<PointField>, 3> xyz;
  bool is_big_endian = false;
  uint32_t point_step = 0;
  uint32_t row_step = 0;
  std::string_view data;
};

absl::StatusOr<Cloud> ReadCloud(const RosBytes& message, const std::string& origin) {
  RosFields fields(message);
  fields.Header();
  Cloud cloud;
  cloud.height = fields.U32();
  cloud.width = fields.U32();
  const uint32_t field_count = fields.U32();
  if (field_count > kFieldsMax) {
    return MalformedFile(origin, absl::StrCat("a point has ", field_count, " fields; at most ",
                                              kFieldsMax, " are read"));
  }
  for (uint32_t i = 0; i < field_count; ++i) {
    const std::string_view name = fields.String();
    PointField field;
    field.offset = fields.U32();
    field.datatype = fields.U8();
    fields.U32();
    const size_t axis = std::string_view("xyz").find(name);
    if (name.size() == 1 && axis != std::string_view::npos) cloud.xyz[axis] = field;
  }
  cloud.is_big_endian = fields.U8() != 0;
  cloud.point_step = fields.U32();
  cloud.row_step = fields.U32();
  cloud.data = fields.Bytes();
  fields.U8();
  DSG_RETURN_IF_ERROR(fields.End(kType, origin));
  return cloud;
}

absl::Status CheckCloud(const Cloud& cloud, const std::string& origin) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    const std::optional<PointField>& field = cloud.xyz[axis];
    if (!field.has_value()) {
      return MalformedFile(origin, absl::StrCat("the points have no field \"", name, "\""));
    }
    if (field->datatype != kFloat32 && field->datatype != kFloat64) {
      return MalformedFile(origin, absl::StrCat("field \"", name, "\" of the points has type ",
                                                field->datatype, "; 7 and 8, floats, are read"));
    }
    if (uint64_t{field->offset} + field->byte_count() > cloud.point_step) {
      return MalformedFile(origin,
                           absl::StrCat("field \"", name, "\" at byte ", field->offset,
                                        " is outside of a point of ", cloud.point_step, " bytes"));
    }
  }
  const uint64_t count = uint64_t{cloud.width} * cloud.height;
  if (count > static_cast<uint64_t>(kImagePixelsMax)) {
    return MalformedFile(origin, absl::StrCat("the cloud has ", count, " points; at most ",
                                              kImagePixelsMax, " are read"));
  }
  const bool fits = cloud.row_step >= uint64_t{cloud.width} * cloud.point_step &&
                    uint64_t{cloud.row_step} * cloud.height == cloud.data.size();
  if (fits) return absl::OkStatus();
  return MalformedFile(
      origin, absl::StrCat("the cloud has ", cloud.data.size(), " bytes; ", cloud.height,
                           " rows of ", cloud.row_step, " with ", cloud.width, " points of ",
                           cloud.point_step, " need others"));
}

template <typename Float>
float ReadFloat(const char* at, bool is_big_endian) {
  std::array<char, sizeof(Float)> bytes;
  std::memcpy(bytes.data(), at, sizeof(Float));
  if (is_big_endian) std::reverse(bytes.begin(), bytes.end());
  return static_cast<float>(std::bit_cast<Float>(bytes));
}

float Coordinate(const Cloud& cloud, const char* point, const PointField& field) {
  const char* const at = point + field.offset;
  return field.datatype == kFloat64 ? ReadFloat<double>(at, cloud.is_big_endian)
                                    : ReadFloat<float>(at, cloud.is_big_endian);
}

}  // namespace

absl::StatusOr<Image> ParseRosPointCloud(const RosBytes& message, const std::string& origin) {
  DSG_ASSIGN_OR_RETURN(const Cloud cloud, ReadCloud(message, origin));
  DSG_RETURN_IF_ERROR(CheckCloud(cloud, origin));
  PointRow points(size_t{cloud.width} * cloud.height);
  for (uint32_t row = 0; row < cloud.height; ++row) {
    for (uint32_t column = 0; column < cloud.width; ++column) {
      const char* const point =
          cloud.data.data() + size_t{row} * cloud.row_step + size_t{column} * cloud.point_step;
      std::array<float, 3> xyz;
      for (size_t axis = 0; axis < 3; ++axis)
        xyz[axis] = Coordinate(cloud, point, *cloud.xyz[axis]);
      points.Add(xyz);
    }
  }
  return points.Take();
}

}  // namespace dsg::ingest
