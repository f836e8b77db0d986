// SPDX-License-Identifier: Apache-2.0
// Point clouds of ROS 1 and ROS 2: the points wherever they stand, and no others.
#include "ingest/log/ros_cloud.h"

#include <cmath>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

const std::vector<std::array<float, 3>> kPoints = {{1, 2, 3}, {NAN, 0, 0}, {-4, 5.5f, 6}};

struct Field {
  std::string name;
  uint32_t offset = 0;
  uint8_t datatype = 7;
};

struct CloudBytes {
  std::vector<Field> fields = {{"x", 0}, {"y", 4}, {"z", 8}};
  uint32_t height = 1;
  uint32_t width = 1;
  uint32_t point_step = 12;
  uint32_t row_step = 12;
  uint8_t is_big_endian = 0;
  std::string data = std::string(12, '\0');

  absl::StatusOr<Image> Parse() const {
    ByteWriter out;
    out.Header(kT0, "lidar").U32(height).U32(width).U32(fields.size());
    for (const Field& field : fields) {
      out.String(field.name).U32(field.offset).U8(field.datatype).U32(1);
    }
    out.U8(is_big_endian).U32(point_step).U32(row_step).Blob(data).U8(1);
    return ParseRosPointCloud(out.bytes(), "cloud");
  }
};

void ExpectThePoints(const absl::StatusOr<Image>& image) {
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->format, PixelFormat::kPoints32);
  ASSERT_EQ(image->width, 2);
  ASSERT_EQ(image->height, 1);
  EXPECT_EQ(PointAt(*image, 0, 0), Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(PointAt(*image, 1, 0), Eigen::Vector3f(-4, 5.5f, 6));
}

TEST(RosCloud, ReadsPointsOfRos1AndRos2) {
  ExpectThePoints(ParseRosPointCloud(CloudFields(ByteWriter(), kT0, "lidar", kPoints), "cloud"));
  for (const bool is_big_endian : {false, true}) {
    const std::string bytes = CloudFields(CdrWriter(is_big_endian), kT0, "lidar", kPoints);
    ExpectThePoints(ParseRosPointCloud(RosBytes(bytes, RosEncoding::kCdr), "cloud"));
  }
}

TEST(RosCloud, ReadsDoublesOfTheOtherOrderInRowsWithGaps) {
  CloudBytes cloud;
  cloud.fields = {{"z", 16, 8}, {"x", 0, 8}, {"y", 8, 8}};
  cloud.height = 2;
  cloud.point_step = 24;
  cloud.row_step = 30;
  cloud.is_big_endian = 1;
  cloud.data.clear();
  for (const std::array<double, 3>& point : {std::array{1.0, 2.0, 3.0}, {-4.0, 5.5, 6.0}}) {
    for (const double number : point) {
      std::string bytes = ByteWriter().F64(number).bytes();
      cloud.data += std::string(bytes.rbegin(), bytes.rend());
    }
    cloud.data += "######";
  }
  ExpectThePoints(cloud.Parse());
}

TEST(RosCloud, NamesWhatIsWrong) {
  const auto expect_malformed = [](const CloudBytes& cloud, const std::string& words) {
    ExpectMalformedFile(cloud.Parse().status(), {"cloud", words});
  };
  EXPECT_TRUE(CloudBytes().Parse().ok());
  expect_malformed({.fields = {{"x", 0}, {"y", 4}}}, "no field \"z\"");
  expect_malformed({.fields = {{"x", 0, 4}, {"y", 4}, {"z", 8}}}, "\"x\" of the points has type 4");
  expect_malformed({.fields = {{"x", 0}, {"y", 4}, {"z", 9}}}, "outside of a point of 12 bytes");
  expect_malformed({.fields = {{"x", 0}, {"y", 4}, {"z", UINT32_MAX - 2}}}, "outside of a point");
  expect_malformed({.width = 2}, "need others");
  expect_malformed({.height = 2}, "need others");
  expect_malformed({.height = 1 << 20, .width = 1 << 20}, "at most");
  expect_malformed({.fields = std::vector<Field>(300, Field{"w", 0})}, "300 fields");
  CloudBytes empty{.width = 0, .row_step = 0, .data = ""};
  ASSERT_TRUE(empty.Parse().ok());
  EXPECT_EQ(empty.Parse()->width, 0);
}

TEST(RosCloud, SurvivesCutsAndChangedBytes) {
  const std::string whole = CloudFields(CdrWriter(), kT0, "lidar", kPoints);
  for (size_t size = 0; size < whole.size(); ++size) {
    const std::string cut = whole.substr(0, size);
    // The last byte and what pads it may be missed by CDR only.
    if (size + 4 < whole.size()) {
      EXPECT_FALSE(ParseRosPointCloud(RosBytes(cut, RosEncoding::kCdr), "cloud").ok()) << size;
    }
  }
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const int flip : {1, 0x80, 0xff}) {
      std::string changed = whole;
      changed[at] = static_cast<char>(changed[at] ^ flip);
      const auto image = ParseRosPointCloud(RosBytes(changed, RosEncoding::kCdr), "cloud");
      EXPECT_LE(image.ok() ? image->width : 0, 3) << at;
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
