// SPDX-License-Identifier: Apache-2.0
// Folders of scans as KITTI has them: what is read, and what is wrong with them.
#include "ingest/log/kitti_folder.h"

#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string ScanBytes(const std::vector<std::array<float, 4>>& points) {
  std::string bytes(16 * points.size(), '\0');
  if (!points.empty()) std::memcpy(bytes.data(), points.data(), bytes.size());
  return bytes;
}

// x right, y down, z forward; 0.1 m behind the lidar.
constexpr char kCalibration[] =
    "P0: 700 0 600 0 0 700 180 0 0 0 1 0\n"
    "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0.1\n";

// Three scans; the camera goes forward a metre a scan, and turns a quarter to the right at last.
class KittiFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    Write("calib.txt", kCalibration);
    Write("times.txt", "0.000000e+00\n1.036e-01\n2.1e-01\n");
    Write("poses.txt",
          "1 0 0 0 0 1 0 0 0 0 1 0\n"
          "1 0 0 0 0 1 0 0 0 0 1 1\n"
          "0 0 1 0 0 1 0 0 -1 0 0 2\n");
    for (const int number : {0, 1, 2}) {
      Write(absl::StrCat("velodyne/00000", number, ".bin"),
            ScanBytes({{1.0f + static_cast<float>(number), 2, 3, 0.5f}, {4, 5, 6, 0.1f}}));
    }
  }
  void Write(const std::string& name, const std::string& bytes) const {
    folder_.Write("seq/" + name, bytes);
  }
  std::string Path() const { return folder_.Path("seq"); }
  void ExpectRefused(const std::string& name, const std::string& bytes,
                     const std::vector<std::string>& words) const {
    Write(name, bytes);
    ExpectMalformedFile(ReadAll(Path()).status(), words);
  }

  TempFolder folder_;
};

TEST_F(KittiFolderTest, GivesScansAndThePosesOfTheLidar) {
  const auto log = ReadAll(Path());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "kitti");
  EXPECT_FALSE(log->info.has_clock);
  ASSERT_TRUE(log->info.rig.lidar.has_value());
  ASSERT_EQ(log->ImageCount("lidar0"), 3);
  EXPECT_EQ(log->images[1].time_ns, 103'600'000);
  const auto scan = log->images[1].load();
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->width, 2);
  EXPECT_EQ(PointAt(*scan, 0, 0), Eigen::Vector3f(2, 2, 3));
  ASSERT_EQ(log->poses.size(), 3u);
  const Pose3d& first = log->poses[0].pose.map_T_agent;
  EXPECT_TRUE(first.position.isZero(1e-12));
  // A metre along x, z up.
  EXPECT_TRUE(log->poses[1].pose.map_T_agent.position.isApprox(Eigen::Vector3d(1, 0, 0)));
  // To the right is clockwise as seen from above; the lidar is 0.1 m before the camera that turns.
  const Pose3d& last = log->poses[2].pose.map_T_agent;
  EXPECT_TRUE((last.orientation * Eigen::Vector3d::UnitX()).isApprox(-Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(last.position.isApprox(Eigen::Vector3d(1.9, -0.1, 0), 1e-9)) << last.position;
  EXPECT_TRUE(HasNote(log->info, "ground truth"));
}

TEST_F(KittiFolderTest, ItsIdentityIsThatOfItsTablesAndScans) {
  const std::string before = ReadAll(Path())->info.content_sha256;
  EXPECT_EQ(ReadAll(Path())->info.content_sha256, before);
  Write("velodyne/000002.bin", ScanBytes({{1, 2, 3, 0}}));
  const std::string other = ReadAll(Path())->info.content_sha256;
  EXPECT_NE(other, before);
  Write("times.txt", "0.0\n0.1\n0.3\n");
  EXPECT_NE(ReadAll(Path())->info.content_sha256, other);
}

TEST_F(KittiFolderTest, LeavesOutPointsThatAreNotFinite) {
  Write("velodyne/000000.bin", ScanBytes({{NAN, 2, 3, 0}, {1, INFINITY, 3, 0}, {1, 2, 3, NAN}}));
  const auto log = ReadAll(Path());
  ASSERT_TRUE(log.ok()) << log.status();
  const auto scan = log->images[0].load();
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->width, 1);
}

TEST_F(KittiFolderTest, CountsScansThatAreAbsent) {
  std::filesystem::remove(Path() + "/velodyne/000001.bin");
  const auto log = ReadAll(Path());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->ImageCount("lidar0"), 2);
  EXPECT_EQ(log->images[1].time_ns, 210'000'000);
  EXPECT_TRUE(HasNote(log->info, "1 of 3 scans of times.txt are not in velodyne"));
  LogOptions strict;
  strict.is_strict = true;
  ExpectMalformedFile(ReadAll(Path(), strict).status(), {"1 of 3 scans"});
}

TEST_F(KittiFolderTest, SaysWhatIsWrong) {
  ExpectRefused("velodyne/000001.bin", ScanBytes({{1, 2, 3, 4}}) + "abc",
                {"000001.bin", "has 19 bytes", "cut short"});
  SetUp();
  ExpectRefused("velodyne/000001.bin", "", {"000001.bin", "is empty"});
  SetUp();
  ExpectRefused("velodyne/000003.bin", ScanBytes({{1, 2, 3, 4}}),
                {"000003.bin", "has no time", "3 lines"});
  std::filesystem::remove(Path() + "/velodyne/000003.bin");
  ExpectRefused("times.txt", "0.0\n0.1\n", {"000002.bin", "has no time"});
  ExpectRefused("times.txt", "0.0\n0.2\n0.1\n", {"times.txt:3", "steps back"});
  ExpectRefused("times.txt", "0.0\nsoon\n0.1\n", {"times.txt:2", "soon"});
  ExpectRefused("times.txt", "0.0 1\n", {"times.txt:1"});
  SetUp();
  ExpectRefused("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n", {"poses.txt", "has 1 poses", "3 times"});
  const std::string pose = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  ExpectRefused("poses.txt", pose + pose + pose + pose, {"poses.txt", "has 4 poses"});
  ExpectRefused("poses.txt", pose + "1 0 0 nan 0 1 0 0 0 0 1 0\n" + pose, {"poses.txt:2", "nan"});
  ExpectRefused("poses.txt", pose + "2 0 0 0 0 2 0 0 0 0 2 0\n" + pose,
                {"poses.txt:2", "are no rotation"});
  ExpectRefused("poses.txt", pose + pose + "1 0 0\n", {"poses.txt:3", "12"});
  SetUp();
  ExpectRefused("calib.txt", "P0: 1 2 3\n", {"calib.txt", "no line \"Tr:\""});
  ExpectRefused("calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 5 0\n", {"calib.txt:1", "no rotation"});
  ExpectRefused("calib.txt", "Tr: 1 0 0\n", {"calib.txt:1"});
  std::filesystem::remove(Path() + "/calib.txt");
  ExpectMalformedFile(ReadAll(Path()).status(), {"calib.txt", "is missing"});
  SetUp();
  std::filesystem::remove(Path() + "/times.txt");
  ExpectMalformedFile(ReadAll(Path()).status(), {"times.txt", "is missing"});
}

TEST_F(KittiFolderTest, TakesPosesOfTheLidarFromAFile) {
  std::filesystem::remove(Path() + "/poses.txt");
  std::filesystem::remove(Path() + "/calib.txt");
  const auto without = ReadAll(Path());
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_TRUE(HasNote(without->info, "holds no poses"));
  LogOptions options;
  options.pose_file = folder_.Write("poses.tum", "0 1 2 3 0 0 0 1\n0.2 2 2 3 0 0 0 1\n");
  const auto log = ReadAll(Path(), options);
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position, Eigen::Vector3d(1, 2, 3));
}

// Three scans of a car; the poses are made: our registration of the scans says 0.7 m a scan.
TEST_F(KittiFolderTest, ReadsRealScans) {
  const std::filesystem::path scans = DataFolder() / "lidar-scans" / "sequence";
  if (DataFolder().empty() || !std::filesystem::is_directory(scans)) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  for (const int number : {0, 1, 2}) {
    const std::string name = absl::StrCat("00000", number, ".bin");
    std::filesystem::copy_file(scans / name, Path() + "/velodyne/" + name,
                               std::filesystem::copy_options::overwrite_existing);
  }
  const auto log = ReadAll(Path());
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->images.size(), 3u);
  const int counts[] = {124668, 124605, 124478};
  for (size_t i = 0; i < 3; ++i) {
    const auto scan = log->images[i].load();
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->width, counts[i]);
    // The road is some 1.7 m below the lidar.
    std::vector<float> heights;
    for (int k = 0; k < scan->width; ++k) {
      const Eigen::Vector3f point = PointAt(*scan, k, 0);
      if (point.head<2>().norm() < 12.0f) heights.push_back(point.z());
    }
    ASSERT_GT(heights.size(), 10'000u);
    std::nth_element(heights.begin(), heights.begin() + heights.size() / 4, heights.end());
    EXPECT_NEAR(heights[heights.size() / 4], -1.7f, 0.2f);
  }
}

}  // namespace
}  // namespace dsg::ingest
