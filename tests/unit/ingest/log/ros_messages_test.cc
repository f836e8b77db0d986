// SPDX-License-Identifier: Apache-2.0
// ROS messages from bytes: whole ones, and every cut and changed one.
#include "ingest/log/ros_messages.h"

#include <gtest/gtest.h>

#include <random>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

TEST(RosMessages, ReadAllTheirFields) {
  const auto imu = ParseRosImu(ImuMessage(3'000'000'007, 0.5, 9.81), "x");
  ASSERT_TRUE(imu.ok()) << imu.status();
  EXPECT_EQ(imu->header.stamp_ns, 3'000'000'007);
  EXPECT_EQ(imu->header.frame_id, "imu");
  EXPECT_EQ(imu->angular_velocity.x(), 0.5);
  EXPECT_EQ(imu->acceleration.z(), 9.81);
  const std::string info_bytes = CameraInfoMessage(6, 4, 5.0, "plumb_bob", {1, 2, 3, 4, 5}, "cam");
  const auto info = ParseRosCameraInfo(info_bytes, "x");
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->width, 6u);
  EXPECT_EQ(info->d.size(), 5u);
  EXPECT_EQ(info->k[0], 5.0);
  EXPECT_EQ(info->p[6], 2.0);
  const auto odometry = ParseRosOdometry(OdometryMessage(9, {1, 2, 3, 0, 0, 0, 1}), "x");
  ASSERT_TRUE(odometry.ok()) << odometry.status();
  EXPECT_EQ(odometry->child_frame_id, "base_link_gt");
  EXPECT_EQ(odometry->ToPose("x")->position, Eigen::Vector3d(1, 2, 3));
  const std::string two = ByteWriter().U32(2).bytes() +
                          TransformBytes(1, "a", "b", {0, 0, 0, 0, 0, 0, 1}) +
                          TransformBytes(1, "b", "c", {0, 0, 0, 0, 0, 0, 1});
  ASSERT_TRUE(ParseRosTransforms(two, "x").ok());
  EXPECT_EQ(ParseRosTransforms(two, "x")->at(1).child_frame_id, "c");
  EXPECT_EQ(ParseRosString(StringMessage("hello"), "x").value(), "hello");
}

TEST(RosMessages, RefusePosesThatAreNone) {
  RosPose pose;
  pose.xyzw = {0, 0, 0, 2};
  EXPECT_FALSE(pose.ToPose("x").ok());
  pose.xyzw = {0, 0, 0, 1};
  EXPECT_TRUE(pose.ToPose("x").ok());
  pose.position.x() = NAN;
  EXPECT_FALSE(pose.ToPose("x").ok());
  pose.position.x() = 1e9;
  EXPECT_FALSE(pose.ToPose("x").ok());
}

TEST(RosMessages, SurviveAnyCutAndAnyChangedByte) {
  constexpr unsigned kSeed = 20091115;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const auto parse_all = [](std::string_view bytes) {
    int count = 0;
    count += ParseRosImage(bytes, "x").ok() ? 1 : 0;
    count += ParseRosCompressedImage(bytes, "x").ok() ? 1 : 0;
    count += ParseRosCameraInfo(bytes, "x").ok() ? 1 : 0;
    count += ParseRosImu(bytes, "x").ok() ? 1 : 0;
    count += ParseRosOdometry(bytes, "x").ok() ? 1 : 0;
    count += ParseRosPoseStamped(bytes, "x").ok() ? 1 : 0;
    count += ParseRosPoseWithCovariance(bytes, "x").ok() ? 1 : 0;
    count += ParseRosTransform(bytes, "x").ok() ? 1 : 0;
    count += ParseRosTransforms(bytes, "x").ok() ? 1 : 0;
    count += ParseRosString(bytes, "x").ok() ? 1 : 0;
    return count;
  };
  for (const std::string& whole :
       {ImuMessage(1, 2, 3), ImageMessage(1, "mono8", 2, 2, 2, "abcd"),
        CameraInfoMessage(6, 4, 5.0, "plumb_bob", {1, 2}, "cam"),
        OdometryMessage(1, {1, 2, 3, 0, 0, 0, 1}),
        PoseWithCovarianceFields(ByteWriter(), 1, {1, 2, 3, 0, 0, 0, 1}), StringMessage("hello")}) {
    EXPECT_GE(parse_all(whole), 1);
    for (size_t size = 0; size < whole.size(); ++size) {
      // Cut bytes may by chance be a whole message of another type; never of the same one.
      parse_all(std::string_view(whole).substr(0, size));
    }
    EXPECT_EQ(parse_all(whole + "x"), 0);
    for (int i = 0; i < 500; ++i) {
      std::string changed = whole;
      changed[random() % changed.size()] = static_cast<char>(random() % 2 == 0 ? 255 : random());
      parse_all(changed);
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
