// SPDX-License-Identifier: Apache-2.0
// Real logs through the real program, compared with an independent reading of the same files:
// counts, every pose, and interpolation at random instants.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

namespace fs = std::filesystem;

// What the source says: agent's name -> time -> position and orientation.
using Track = std::map<TimeNs, Pose3d>;
using Tracks = std::map<std::string, Track>;

std::string DataFolder() {
  const char* text = std::getenv("DSG_DATA");
  return text != nullptr ? text : std::string(DSG_SOURCE_DIR) + "/../shared/data";
}

// Rows of numbers, separated by commas or white space; lines that begin with '#' are left out.
std::vector<std::vector<double>> ReadNumbers(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::vector<double> row;
    for (double value; fields >> value;) row.push_back(value);
    rows.push_back(row);
  }
  return rows;
}

// frame, person, x, y at the given columns; frames become time as the command line promises:
// the first frame is the epoch, the usual step lasts 0.4 s.
Tracks ReadAnnotations(const std::string& path, size_t y_column, double usual_step) {
  Tracks tracks;
  const auto rows = ReadNumbers(path);
  double first = rows.front()[0];
  for (const auto& row : rows) first = std::min(first, row[0]);
  for (const auto& row : rows) {
    const auto t = static_cast<TimeNs>(std::llround((row[0] - first) / usual_step * 4.0e8));
    Pose3d pose;
    pose.position = {row[2], row[y_column], 0.0};
    tracks[std::to_string(std::llround(row[1]))][t] = pose;
  }
  return tracks;
}

Tracks ReadEuroc(const std::string& path) {
  Tracks tracks;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    TimeNs t = 0;
    std::array<double, 7> v{};
    fields >> t;
    for (double& value : v) fields >> value;
    Pose3d pose;
    pose.position = {v[0], v[1], v[2]};
    pose.orientation = Eigen::Quaterniond(v[3], v[4], v[5], v[6]).normalized();
    tracks["body"][t] = pose;
  }
  return tracks;
}

struct Log {
  std::string name;
  std::string path;
  Tracks (*read)(const std::string& path);
  size_t agent_count;
  size_t pose_count;
};

const Log kLogs[] = {
    {"Eth", "people-eth-ucy/eth/obsmat.txt",
     [](const std::string& path) { return ReadAnnotations(path, 4, 6.0); }, 360, 8908},
    {"Zara01", "people-eth-ucy/zara01/obsmat.txt",
     [](const std::string& path) { return ReadAnnotations(path, 4, 10.0); }, 148, 5024},
    {"Zara03", "people-eth-ucy/zara03/crowds_zara03.txt",
     [](const std::string& path) { return ReadAnnotations(path, 3, 10.0); }, 137, 5005},
    {"Students003", "people-eth-ucy/students003/students003.txt",
     [](const std::string& path) { return ReadAnnotations(path, 3, 10.0); }, 434, 17953},
    {"EurocV102", "euroc-imu-groundtruth/V1_02_medium/state_groundtruth_estimate0/data.csv",
     ReadEuroc, 1, 16702},
    {"EurocMh01", "euroc-mh01-stereo/mav0/state_groundtruth_estimate0/data.csv", ReadEuroc, 1,
     1791},
};

class RealLogsTest
    : public testing::TestWithParam<std::tuple<Log, std::pair<const char*, double>>> {
 protected:
  void SetUp() override {
    const auto& [log, codec] = GetParam();
    const std::string path = DataFolder() + "/" + log.path;
    if (!fs::exists(path)) GTEST_SKIP() << "no " << path << "; set DSG_DATA to the folder of logs";
    source_ = log.read(path);
    const std::string command = std::string(DSG_BINARY_DIR) +
                                "/dsg-ingest --quiet --no-layers --store " + folder_.path() +
                                " --map log --codec " + codec.first + " " + path;
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    auto map = (*store)->OpenMap("log");
    ASSERT_TRUE(map.ok()) << map.status();
    map_ = *map;
    snapshot_ = *map_->Latest();
  }

  // The codec's bound on a position, metres, and on a rotation, radians.
  static double PositionBound() { return std::get<1>(GetParam()).second; }
  static double RotationBound() { return PositionBound() == 0.0 ? 0.0 : 6e-5; }

  test::TempFolder folder_;
  Tracks source_;
  std::shared_ptr<MapReader> map_;
  std::shared_ptr<const Snapshot> snapshot_;
};

TEST_P(RealLogsTest, HoldsEveryAgentAndEveryPoseOfTheLog) {
  const Log& log = std::get<0>(GetParam());
  EXPECT_EQ(source_.size(), log.agent_count);
  size_t pose_count = 0;
  for (const auto& [name, track] : source_) {
    const auto agent = snapshot_->ResolveAgent(name);
    ASSERT_TRUE(agent.ok()) << agent.status();
    auto expected = track.begin();
    ASSERT_TRUE(
        snapshot_
            ->ReadPoses(*agent, kTimeMin, kTimeMax, {},
                        [&](const TimedPose& pose) {
                          EXPECT_NE(expected, track.end());
                          if (expected == track.end()) return false;
                          EXPECT_EQ(pose.time_ns, expected->first);
                          EXPECT_LE((pose.map_T_agent.position - expected->second.position).norm(),
                                    PositionBound());
                          ++expected;
                          ++pose_count;
                          return true;
                        })
            .ok());
    EXPECT_EQ(expected, track.end()) << name;
  }
  EXPECT_EQ(pose_count, log.pose_count);
  const auto stats = snapshot_->Stats();
  ASSERT_TRUE(stats.ok());
  EXPECT_EQ(stats->at.agent_count, static_cast<int64_t>(log.agent_count));
  EXPECT_EQ(stats->at.pose_count, static_cast<int64_t>(log.pose_count));
}

TEST_P(RealLogsTest, LocateEqualsIndependentInterpolationAtRandomInstants) {
  std::mt19937_64 random(test::TestSeed(41));
  std::vector<std::pair<std::string, const Track*>> tracks;
  for (const auto& [name, track] : source_) tracks.emplace_back(name, &track);
  int interpolated_count = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto& [name, track] = tracks[random() % tracks.size()];
    const TimeNs first = track->begin()->first;
    const TimeNs last = track->rbegin()->first;
    const TimeNs t =
        first + static_cast<TimeNs>(random() % static_cast<uint64_t>(last - first + 1));
    const auto agent = snapshot_->ResolveAgent(name);
    ASSERT_TRUE(agent.ok());
    const auto located = snapshot_->Locate(*agent, t);
    ASSERT_TRUE(located.ok()) << located.status();
    const auto after = track->lower_bound(t);
    const auto before = after->first == t ? after : std::prev(after);
    EXPECT_EQ(located->before_ns, before->first);
    EXPECT_EQ(located->after_ns, after->first);
    if (after->first - before->first > 2 * kNsPerSecond) {
      EXPECT_EQ(located->quality, PoseQuality::kInGap);
      continue;
    }
    const double span = static_cast<double>(after->first - before->first);
    const double s = span == 0.0 ? 0.0 : static_cast<double>(t - before->first) / span;
    const Eigen::Vector3d position =
        (1.0 - s) * before->second.position + s * after->second.position;
    const Eigen::Quaterniond orientation =
        before->second.orientation.slerp(s, after->second.orientation);
    EXPECT_LE((located->map_T_agent.position - position).norm(), PositionBound() + 1e-12) << t;
    EXPECT_LE(AngleBetween(located->map_T_agent.orientation, orientation), RotationBound() + 1e-9)
        << t;
    ++interpolated_count;
  }
  EXPECT_GT(interpolated_count, 500);
}

INSTANTIATE_TEST_SUITE_P(Logs, RealLogsTest,
                         testing::Combine(testing::ValuesIn(kLogs),
                                          testing::Values(std::make_pair("quantized", 1e-4),
                                                          std::make_pair("lossless", 0.0))),
                         [](const auto& param_info) {
                           return std::get<0>(param_info.param).name + "_" +
                                  std::get<1>(param_info.param).first;
                         });

struct SensorLog {
  std::string name;
  std::string path;
  std::string options;
  int64_t pose_count;
  // Part of the line that says what was read and not used.
  std::string unused;
};

const SensorLog kSensorLogs[] = {
    {"EurocMh01", "euroc-mh01-stereo", "--poses gt", 1791,
     "1791 inertial samples, 320 images (cam0 160, cam1 160)"},
    {"EurocV102", "euroc-imu-groundtruth/V1_02_medium", "--poses gt", 16702,
     "17100 inertial samples"},
    {"LoopPairs", "euroc-loop-pairs", "--poses external", 4, "8 images (cam0 4, cam1 4)"},
    {"SevenScenes", "rgbd-7scenes", "--poses external", 125, "250 images (color0 125, depth0 125)"},
    {"LivingRoom", "rgbd-livingroom1", "", 106, "212 images (color0 106, depth0 106)"},
    {"Replica", "rgbd-replica-office0", "", 2000, "4 images (color0 2, depth0 2)"},
    {"TesseRgbd", "uhumans2-tesse/rgbd", "", 0, "color0 2, depth0 2"},
    {"TesseLoopPair", "uhumans2-tesse/loop_pair", "", 2, "4 images (color0 2, depth0 2)"},
    {"EurocBag", "bags/euroc_mh01_stereo_4pairs_bz2.bag", "", 0, "cam0 4, cam1 4, imu0 49"},
};

class SensorLogsTest : public testing::TestWithParam<SensorLog> {};

TEST_P(SensorLogsTest, GivesItsPosesAndCountsTheRest) {
  const SensorLog& log = GetParam();
  const std::string path = DataFolder() + "/" + log.path;
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path << "; set DSG_DATA to the folder of logs";
  const test::TempFolder folder;
  const std::string output = folder.path() + "/output";
  const std::string command = std::string(DSG_BINARY_DIR) + "/dsg-ingest --no-layers --store " +
                              folder.path() + "/store --map log " + log.options + " " + path +
                              " > " + output + " 2>&1";
  // A log that gives nothing is an error, and leaves no map.
  const int status = std::system(command.c_str());
  ASSERT_EQ(WEXITSTATUS(status), log.pose_count > 0 ? 0 : 1) << command;
  std::stringstream text;
  text << std::ifstream(output).rdbuf();
  const std::string counted =
      log.pose_count > 0 ? "read and not used yet: " + log.unused + "\n" : "(" + log.unused + ")";
  EXPECT_NE(text.str().find(counted), std::string::npos) << text.str();
  auto store = GraphStore::Open(folder.path() + "/store", {});
  ASSERT_TRUE(store.ok()) << store.status();
  const auto map = (*store)->OpenMap("log");
  ASSERT_EQ(map.ok(), log.pose_count > 0) << map.status();
  if (!map.ok()) return;
  const auto stats = (*(*map)->Latest())->Stats();
  ASSERT_TRUE(stats.ok()) << stats.status();
  EXPECT_EQ(stats->at.pose_count, log.pose_count);
}

INSTANTIATE_TEST_SUITE_P(Logs, SensorLogsTest, testing::ValuesIn(kSensorLogs),
                         [](const auto& param_info) { return param_info.param.name; });

}  // namespace
}  // namespace dsg
