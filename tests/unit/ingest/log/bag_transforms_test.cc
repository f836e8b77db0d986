// SPDX-License-Identifier: Apache-2.0
// /tf and /tf_static: where the robot is, and where its sensors sit.
#include "ingest/log/bag_transforms.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

class BagTransformsTest : public testing::Test {
 protected:
  void Add(const std::string& topic, const std::vector<Tf>& transforms) {
    recording_.push_back({topic, "tf2_msgs/TFMessage", kT0 + static_cast<TimeNs>(recording_.size()),
                          TfMessage(transforms)});
  }
  absl::StatusOr<WholeLog> Read(const LogOptions& options = {}) {
    return ReadAll(folder_.Write("log.mcap", WriteMcap(recording_)), options);
  }
  static std::string Notes(const WholeLog& log) {
    std::string notes;
    for (const std::string& note : log.info.notes) notes += note + "\n";
    return notes;
  }
  TempFolder folder_;
  Recording recording_;
};

TEST_F(BagTransformsTest, MakeThePosesOfTheRobotInTheMap) {
  Add("/tf_static", {{"base_footprint", "base_link", 1, {0, 0, 0.5, 0, 0, 0, 1}}});
  // The map drifts against the odometry: a quarter turn from the second second on.
  Add("/tf", {{"map", "odom", kT0, {10, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"map", "odom", kT0 + kNsPerSecond, {10, 0, 0, 0, 0, M_SQRT1_2, M_SQRT1_2}}});
  for (int i = 0; i < 3; ++i) {
    Add("/tf", {{"odom", "/base_footprint", kT0 + i * kNsPerSecond, {1.0 * i, 0, 0, 0, 0, 0, 1}},
                {"base_link", "wheel", kT0 + i * kNsPerSecond, {0, 0.3, 0, 0, 0, 0, 1}}});
  }
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 3u);
  EXPECT_EQ(log->poses[0].agent_name, "body");
  EXPECT_EQ(log->info.first_ns, kT0);
  EXPECT_TRUE(log->poses[0].pose.map_T_agent.position.isApprox(Eigen::Vector3d(10, 0, 0.5), 1e-12));
  // After the turn the robot's way along x of the odometry is along y of the map.
  EXPECT_TRUE(log->poses[1].pose.map_T_agent.position.isApprox(Eigen::Vector3d(10, 1, 0.5), 1e-12));
  EXPECT_TRUE(log->poses[2].pose.map_T_agent.position.isApprox(Eigen::Vector3d(10, 2, 0.5), 1e-12));
  EXPECT_NE(Notes(*log).find("external: /tf, frame \"base_link\" in \"map\""), std::string::npos)
      << Notes(*log);
}

TEST_F(BagTransformsTest, InterpolateWhatIsAboveTheLowestThatMoves) {
  Add("/tf", {{"map", "odom", kT0, {0, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"map", "odom", kT0 + 2 * kNsPerSecond, {2, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"odom", "base_link", kT0 + kNsPerSecond, {0, 5, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"odom", "base_link", kT0 + 3 * kNsPerSecond, {0, 6, 0, 0, 0, 0, 1}}});
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position, Eigen::Vector3d(1, 5, 0));
  EXPECT_EQ(log->poses[1].pose.map_T_agent.position, Eigen::Vector3d(2, 6, 0));
}

TEST_F(BagTransformsTest, TakeTheOnlyFrameThatMovesAndRobotsThatStand) {
  for (int i = 0; i < 2; ++i)
    Add("/tf", {{"world", "turtle1", kT0 + i, {1.0 * i, 0, 0, 0, 0, 0, 1}}});
  auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 2u);
  recording_.clear();
  for (int i = 0; i < 4; ++i) Add("/tf", {{"odom", "base_link", kT0 + i}});
  log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 4u);
}

TEST_F(BagTransformsTest, PassOverRepeatsAndWhatIsNoPose) {
  Add("/tf", {{"odom", "base_link", kT0, {0, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"odom", "base_link", kT0, {0, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"odom", "base_link", kT0 + 5, {0, 0, 0, 0, 0, 0, 0}}});
  Add("/tf", {{"odom", "base_link", kT0 + 9, {1, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"odom", "base_link", kT0 + 8, {2, 0, 0, 0, 0, 0, 1}}});
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 2u);
  EXPECT_NE(Notes(*log).find("2 transforms of /tf"), std::string::npos) << Notes(*log);
}

TEST_F(BagTransformsTest, RefuseCirclesAndTwoParents) {
  for (int i = 0; i < 2; ++i) {
    Add("/tf", {{"odom", "base_link", kT0 + i, {1.0 * i, 0, 0, 0, 0, 0, 1}},
                {"map", "odom", kT0 + i},
                {"base_link", "map", kT0 + i}});
  }
  ExpectMalformedFile(Read().status(),
                      {"circle", "\"base_link\" in \"odom\" in \"map\" in \"base_link\""});
  recording_.clear();
  Add("/tf", {{"odom", "base_link", kT0, {0, 0, 0, 0, 0, 0, 1}}});
  Add("/tf", {{"world", "base_link", kT0 + 1, {1, 0, 0, 0, 0, 0, 1}}});
  ExpectMalformedFile(Read().status(), {"\"base_link\"", "\"odom\"", "\"world\"", "one parent"});
  recording_.clear();
  std::vector<Tf> many;
  for (int i = 0; i < 10'001; ++i) many.push_back({"odom", absl::StrCat("frame", i), kT0});
  Add("/tf", many);
  ExpectMalformedFile(Read().status(), {"/tf message 1", "10000 frames"});
}

TEST_F(BagTransformsTest, SayWhereACameraSitsThatOnlyTfKnows) {
  recording_.push_back({"/tesse/left_cam/camera_info", "sensor_msgs/CameraInfo", kT0,
                        CameraInfoFields(CdrWriter(), 2, 1, 415.7, "left_optical")});
  recording_.push_back({"/tesse/left_cam/mono/image_raw", "sensor_msgs/Image", kT0,
                        ImageFields(CdrWriter(), kT0, "mono8", 2, 1, 2, "ab")});
  for (int i = 0; i < 3; ++i) {
    Add("/tf", {{"odom", "base_link", kT0 + i, {1.0 * i, 0, 0, 0, 0, 0, 1}},
                {"base_link", "left_cam", kT0 + i, {0.25, 0, 0, 0, 0, 0, 1}},
                {"left_cam", "left_optical", kT0 + i, {0, 0, 0, 0.5, -0.5, 0.5, -0.5}}});
  }
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  const CameraCalibration* camera = log->info.rig.FindCamera("cam0");
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(camera->body_T_camera.position, Eigen::Vector3d(0.25, 0, 0));
  EXPECT_NEAR((camera->body_T_camera.orientation * Eigen::Vector3d::UnitZ()).x(), 1.0, 1e-9);
  EXPECT_EQ(log->poses.size(), 3u);
}

TEST_F(BagTransformsTest, GoBehindATopicOfPoses) {
  recording_ = SmallRecording(CdrWriter(), 3);
  for (int i = 0; i < 2; ++i)
    Add("/tf", {{"odom", "base_link", kT0 + i, {7.0 + i, 0, 0, 0, 0, 0, 1}}});
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.at(0).pose.map_T_agent.position, Eigen::Vector3d(0, 2, 3));
  EXPECT_NE(Notes(*log).find("/tf is not taken for poses"), std::string::npos) << Notes(*log);
  LogOptions options;
  options.poses = PoseSource::kExternal;
  const auto external = Read(options);
  ASSERT_TRUE(external.ok()) << external.status();
  EXPECT_EQ(external->poses.at(0).pose.map_T_agent.position.x(), 7.0);
}

}  // namespace
}  // namespace dsg::ingest
