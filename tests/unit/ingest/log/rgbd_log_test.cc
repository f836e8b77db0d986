// SPDX-License-Identifier: Apache-2.0
// Folders of RGB-D datasets: frames become times, matrices become poses, holes are named.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string Encoded(const std::string& ending, int type) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(ending, cv::Mat(3, 4, type, cv::Scalar(2, 2, 2)), bytes));
  return {bytes.begin(), bytes.end()};
}

std::string Matrix(double x, double scale = 1.0, const std::string& end = "\n") {
  return absl::StrCat(scale, " 0 0 ", x, end, "0 1 0 0", end, "0 0 1 0", end, "0 0 0 1\n");
}

TEST(RgbdLog, ReadsSevenScenes) {
  const TempFolder folder;
  for (const int frame : {0, 8}) {
    const std::string stem = absl::StrCat("frames/frame-00000", frame);
    folder.Write(stem + ".color.jpg", Encoded(".jpg", CV_8UC3));
    folder.Write(stem + ".depth.png", Encoded(".png", CV_16UC1));
    folder.Write(stem + ".pose.txt", frame == 0 ? Matrix(5.0, 1.005) : "-inf -inf\n");
  }
  folder.Write("camera-intrinsics.txt", "585 0 320\n0 585 240\n0 0 1\n");
  LogOptions options;
  options.epoch_ns = 1000;
  options.image_period_ns = 10;
  const auto log = ReadAll(folder.Path(""), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "rgbd");
  EXPECT_FALSE(log->info.has_clock);
  EXPECT_EQ(log->info.first_ns, 1000);
  EXPECT_EQ(log->order.back(), (std::pair<std::string, TimeNs>("depth0", 1080)));
  ASSERT_EQ(log->poses.size(), 1u);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position.x(), 5.0);
  EXPECT_EQ(log->info.rig.FindCamera("depth0")->fx, 585.0);
  EXPECT_EQ(log->info.rig.FindCamera("depth0")->width, 4);
  std::string notes;
  for (const std::string& note : log->info.notes) notes += note + "\n";
  EXPECT_NE(notes.find("1 frames have no pose"), std::string::npos) << notes;
  EXPECT_NE(notes.find("mended"), std::string::npos) << notes;
  options.poses = PoseSource::kGroundTruth;
  EXPECT_EQ(ReasonOf(ReadAll(folder.Path(""), options).status()), Reason::kFieldInvalid);
}

class RedwoodTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const int frame : {0, 2}) {
      folder_.Write(absl::StrCat("image/0000", frame, ".jpg"), Encoded(".jpg", CV_8UC3));
      folder_.Write(absl::StrCat("depth/0000", frame, ".png"), Encoded(".png", CV_16UC1));
    }
    folder_.Write("trajectory.log", "0 0 1\n" + Matrix(1.0) + "2 2 3\n" + Matrix(2.0));
  }
  void ExpectMalformed(const std::vector<std::string>& parts) {
    const absl::Status status = ReadAll(folder_.Path("")).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
    for (const std::string& part : parts) {
      EXPECT_NE(std::string(status.message()).find(part), std::string::npos)
          << "no \"" << part << "\" in: " << status.message();
    }
  }
  TempFolder folder_;
};

TEST_F(RedwoodTest, ReadsFramesAndPoses) {
  const auto log = ReadAll(folder_.Path(""));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[1].pose.time_ns, 2 * TimeNs{33'333'333});
  EXPECT_EQ(log->info.rig.FindCamera("color0")->fx, 525.0);
}

TEST_F(RedwoodTest, NamesWhatIsWrong) {
  folder_.Write("trajectory.log", "0 0 1\n" + Matrix(1.0, 1.5));
  ExpectMalformed({"trajectory.log", "rotation"});
  folder_.Write("trajectory.log", "0 0 1\n1 0 0 0\n0 1 0 0\n");
  ExpectMalformed({"trajectory.log", "16 numbers", "8"});
  folder_.Write("trajectory.log", "0 0\n");
  ExpectMalformed({"trajectory.log:1", "3 columns"});
  folder_.Write("trajectory.log", "0 0 1\n" + Matrix(1.0) + "0 0 1\n" + Matrix(1.0));
  ExpectMalformed({"frame 0", "second pose"});
  folder_.Write("trajectory.log", "0 0 1\n" + Matrix(1.0));
  folder_.Write("depth/00004.png", Encoded(".png", CV_16UC1));
  ExpectMalformed({"depth/00004.png", "frame 4", "color0"});
}

TEST(RgbdLog, ReadsReplicaWithItsDepthUnit) {
  const TempFolder folder;
  folder.Write("results/frame000001.jpg", Encoded(".jpg", CV_8UC3));
  folder.Write("results/depth000001.png", Encoded(".png", CV_16UC1));
  folder.Write("traj.txt", Matrix(1.0, 1.0, " ") + Matrix(2.0, 1.0, " ") + Matrix(3.0, 1.0, " "));
  const auto log = ReadAll(folder.Path(""));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses.size(), 3u);
  EXPECT_FLOAT_EQ(DepthAt(*log->images.at(1).load(), 0, 0), 2.0f / 6553.5f);
}

TEST(RgbdLog, ReadsKimerasFrames) {
  const std::string yaml =
      "%YAML:1.0\ncamera_id: left_cam\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [0, 0, 1, 0, -1, 0, 0, 0.05, 0, -1, 0, 0, 0, 0, 0, 1]\nresolution: [4, 3]\n"
      "intrinsics: [4, 4, 2, 1]\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [0, 0, 0, 0]\n";
  const TempFolder folder;
  folder.Write("rgbd/left_img_0.png", Encoded(".png", CV_8UC3));
  folder.Write("rgbd/depth_img_0.tiff", Encoded(".tiff", CV_32FC1));
  folder.Write("rgbd/sensorLeft.yaml", yaml);
  const auto rgbd = ReadAll(folder.Path("rgbd"));
  ASSERT_TRUE(rgbd.ok()) << rgbd.status();
  EXPECT_TRUE(rgbd->poses.empty());
  EXPECT_EQ(DepthAt(*rgbd->images.at(1).load(), 0, 0), 2.0f);
  EXPECT_EQ(rgbd->info.rig.FindCamera("depth0")->body_T_camera.position.y(), 0.05);

  for (const char* side : {"left", "right"}) {
    for (const int i : {0, 1}) {
      folder.Write(absl::StrCat("stereo/", side, "_img_", i, ".png"), Encoded(".png", CV_8UC1));
    }
  }
  folder.Write("stereo/sensorLeft.yaml", yaml);
  folder.Write("stereo/sensorRight.yaml", yaml);
  const std::string header = "index,role,pair,timestamp_ns,qw,qx,qy,qz,px,py,pz\n";
  folder.Write("stereo/poses.csv",
               header + "0,match,1,900,1,0,0,0,1,2,3\n1,query,1,500,1,0,0,0,4,5,6\n");
  const auto stereo = ReadAll(folder.Path("stereo"));
  ASSERT_TRUE(stereo.ok()) << stereo.status();
  EXPECT_TRUE(stereo->info.has_clock);
  EXPECT_EQ(stereo->info.first_ns, 500);
  EXPECT_EQ(stereo->poses[0].pose.map_T_agent.position, Eigen::Vector3d(4, 5, 6));
  EXPECT_NE(stereo->images[0].origin.find("left_img_1"), std::string::npos);
  folder.Write("stereo/poses.csv", header + "0,match,1,900,1,0,0,0,1,2,3\n");
  EXPECT_EQ(ReasonOf(ReadAll(folder.Path("stereo")).status()), Reason::kFileMalformed);
}

}  // namespace
}  // namespace dsg::ingest
