// SPDX-License-Identifier: Apache-2.0
// RGB-D folders of TUM's form: tables of stamps, a trajectory, and what stands for a calibration.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kSettings[] =
    "%YAML:1.0\nCamera.fx: 535.4\nCamera.fy: 539.2\nCamera.cx: 2\nCamera.cy: 1\n"
    "Camera.k1: 0.0\nCamera.k2: 0.0\nDepthMapFactor: 2500.0\n";

class TumFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    WriteTables("1600000000.10", "1600000000.11");
    folder_.Write("log/groundtruth.txt",
                  "# ground truth\n1600000000.00 1 2 3 0 0 0 1\n1600000001.00 2 2 3 0 0 0 1\n");
    for (const char* const name : {"log/rgb/a.png", "log/rgb/b.png"}) {
      folder_.Write(name, Picture(CV_8UC3));
    }
    for (const char* const name : {"log/depth/a.png", "log/depth/b.png"}) {
      folder_.Write(name, Picture(CV_16UC1));
    }
  }

  static std::string Picture(int type) {
    std::vector<uint8_t> bytes;
    EXPECT_TRUE(cv::imencode(".png", cv::Mat(3, 4, type, cv::Scalar(250, 250, 250)), bytes));
    return {bytes.begin(), bytes.end()};
  }
  void WriteTables(const std::string& color, const std::string& depth) const {
    folder_.Write("log/rgb.txt",
                  absl::StrCat("# color images\n", color, " rgb/a.png\n", color, "5 rgb/b.png\n"));
    folder_.Write("log/depth.txt", absl::StrCat("# depth maps\n", depth, " depth/a.png\n", depth,
                                                "5 depth/b.png\n"));
  }
  absl::StatusOr<WholeLog> Read(const LogOptions& options = {}) const {
    return ReadAll(folder_.Path("log"), options);
  }
  void ExpectMalformed(const std::vector<std::string>& parts) const {
    ExpectMalformedFile(Read().status(), parts);
  }
  TempFolder folder_;
};

TEST_F(TumFolderTest, KeepsTheStampsOfColourDepthAndTrajectory) {
  folder_.Write("log/accelerometer.txt", "1 2 3 4\n");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "tum-rgbd");
  EXPECT_TRUE(log->info.has_clock);
  EXPECT_EQ(log->info.first_ns, 1'600'000'000'000'000'000);
  const std::vector<std::pair<std::string, TimeNs>> order = {
      {"poses", 1'600'000'000'000'000'000},  {"color0", 1'600'000'000'100'000'000},
      {"color0", 1'600'000'000'105'000'000}, {"depth0", 1'600'000'000'110'000'000},
      {"depth0", 1'600'000'000'115'000'000}, {"poses", 1'600'000'001'000'000'000}};
  EXPECT_EQ(log->order, order);
  EXPECT_FLOAT_EQ(DepthAt(*log->images.at(2).load(), 0, 0), 250.0f / 5000.0f);
  EXPECT_TRUE(HasNote(log->info, "ground truth"));
  EXPECT_TRUE(HasNote(log->info, "accelerometer.txt is not read"));
  LogOptions options;
  options.poses = PoseSource::kGroundTruth;
  EXPECT_TRUE(Read(options).ok());
}

TEST_F(TumFolderTest, TakesTheCameraFromTheFolderOrItsName) {
  const auto plain = Read();
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_EQ(plain->info.rig.FindCamera("depth0")->fx, 525.0);
  EXPECT_TRUE(HasNote(plain->info, "PrimeSense"));
  std::filesystem::rename(folder_.Path("log"), folder_.Path("rgbd_freiburg1_xyz"));
  const auto named = ReadAll(folder_.Path("rgbd_freiburg1_xyz"));
  ASSERT_TRUE(named.ok()) << named.status();
  const CameraCalibration& camera = *named->info.rig.FindCamera("color0");
  EXPECT_EQ(camera.fx, 517.3);
  EXPECT_EQ(camera.width, 4);
  EXPECT_EQ(camera.distortion, Distortion::kRadialTangential);
  EXPECT_TRUE(HasNote(named->info, "published for freiburg1"));
  std::filesystem::rename(folder_.Path("rgbd_freiburg1_xyz"), folder_.Path("log"));
  folder_.Write("log/settings.yaml", kSettings);
  const auto settings = Read();
  ASSERT_TRUE(settings.ok()) << settings.status();
  EXPECT_EQ(settings->info.rig.FindCamera("depth0")->fy, 539.2);
  EXPECT_EQ(settings->info.rig.FindCamera("depth0")->distortion, Distortion::kNone);
  EXPECT_FLOAT_EQ(DepthAt(*settings->images.at(2).load(), 0, 0), 0.1f);
  EXPECT_NE(settings->info.content_sha256, plain->info.content_sha256);
  folder_.Write("log/camera-intrinsics.txt", "500 0 2\n0 500 1\n0 0 1\n");
  const auto matrix = Read();
  ASSERT_TRUE(matrix.ok()) << matrix.status();
  EXPECT_EQ(matrix->info.rig.FindCamera("depth0")->fx, 500.0);
}

TEST_F(TumFolderTest, GivesNumberedFramesTheStampsOfTheirRows) {
  folder_.Write("log/rgb.txt", "0 rgb/a.png\n1 rgb/b.png\n");
  folder_.Write("log/depth.txt", "0 depth/a.png\n1 depth/b.png\n");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->info.has_clock);
  EXPECT_EQ(log->images.at(0).time_ns, 1'600'000'000'000'000'000);
  EXPECT_EQ(log->images.at(3).time_ns, 1'600'000'001'000'000'000);
  EXPECT_TRUE(HasNote(log->info, "count frames"));
}

TEST_F(TumFolderTest, CountsFromTheEpochWithoutAClock) {
  WriteTables("0.10", "0.11");
  folder_.Write("log/groundtruth.txt", "0.00 1 2 3 0 0 0 1\n1.00 2 2 3 0 0 0 1\n");
  LogOptions options;
  options.epoch_ns = 7;
  const auto log = Read(options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(log->info.has_clock);
  EXPECT_EQ(log->info.first_ns, 7);
  EXPECT_EQ(log->images.at(0).time_ns, 100'000'007);
}

TEST_F(TumFolderTest, NamesWhatIsWrong) {
  folder_.Write("log/rgb.txt", "1600000000.1 rgb/a.png\n1600000000.1 rgb/b.png\n");
  ExpectMalformed({"rgb.txt:2", "repeats the stamp"});
  folder_.Write("log/rgb.txt", "1600000000.1 ../rgb/a.png\n");
  ExpectMalformed({"rgb.txt:1", "filename", "in the folder"});
  folder_.Write("log/rgb.txt", "1600000000.1 /etc/hostname\n");
  ExpectMalformed({"rgb.txt:1", "filename", "in the folder"});
  folder_.Write("log/rgb.txt", "1600000000.1 rgb/a.png\n1600000000.2 rgb/c.png\n");
  ExpectMalformed({"rgb/c.png", "not there", "1 of 2"});
  folder_.Write("log/rgb.txt", "# nothing\n");
  ExpectMalformed({"rgb.txt:1", "no picture"});
  folder_.Write("log/rgb.txt", "soon rgb/a.png\n");
  ExpectMalformed({"rgb.txt:1", "field timestamp", "seconds"});
  WriteTables("1600000000.10", "1600000000.11");
  folder_.Write("log/settings.yaml", "Camera.fx: 500\n");
  ExpectMalformed({"settings.yaml", "Camera.fy", "missing"});
  folder_.Write("log/settings.yaml", Changed(kSettings, "2500.0", "0"));
  ExpectMalformed({"settings.yaml", "DepthMapFactor", "1 to 65536"});
  folder_.Write("log/settings.yaml", kSettings);
  folder_.Write("log/groundtruth.txt", "1600000000.00 1 2 3 0 0 0 9\n");
  ExpectMalformed({"groundtruth.txt:1", "norm is 9"});
}

}  // namespace
}  // namespace dsg::ingest
