// SPDX-License-Identifier: Apache-2.0
// Whole logs: their files, their bytes, and what they refuse to overwrite.
#include "ingest/simulator/tracks/tracks_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::simulator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFiles[] = {"log/map.json",       "log/tracks.csv",   "truth/tracks.csv",
                                  "truth/presence.csv", "truth/pauses.csv", "truth/picks.csv",
                                  "README.txt",         "preview.png"};

class TracksLog : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("dsg_tracks_" + std::to_string(getpid()) + "_" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  TracksOptions Options(const std::string& name) const {
    TracksOptions options;
    options.out = (folder_ / name).string();
    options.crowd = {3, 60.0};
    options.sensor.gap_rate_per_min = 3.0;
    return options;
  }
  std::string Read(const std::string& name, const std::string& file) const {
    std::ifstream in(folder_ / name / file, std::ios::binary);
    EXPECT_TRUE(in.good()) << name << "/" << file;
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  std::vector<std::vector<std::string>> ReadRows(const std::string& name,
                                                 const std::string& file) const {
    std::vector<std::vector<std::string>> rows;
    for (const absl::string_view line : absl::StrSplit(Read(name, file), '\n', absl::SkipEmpty())) {
      rows.push_back(absl::StrSplit(line, ','));
    }
    return rows;
  }

  fs::path folder_;
};

double Number(const std::string& text) {
  double value = 0.0;
  EXPECT_TRUE(absl::SimpleAtod(text, &value)) << text;
  return value;
}

TEST_F(TracksLog, IsTheSameForTheSameSeedAndAnotherForAnother) {
  ASSERT_TRUE(WriteTracks(Options("a"), nullptr).ok());
  ASSERT_TRUE(WriteTracks(Options("b"), nullptr).ok());
  TracksOptions other = Options("c");
  other.world.seed = 2;
  ASSERT_TRUE(WriteTracks(other, nullptr).ok());
  for (const char* file : kFiles) {
    EXPECT_TRUE(Read("a", file) == Read("b", file)) << file;
    // Nobody is asked to take anything, so that there is nothing to differ.
    if (std::string(file) == "truth/picks.csv") continue;
    EXPECT_TRUE(Read("a", file) != Read("c", file)) << file;
  }
}

TEST_F(TracksLog, ListsRowsByTimeThenAgentWithGrowingStamps) {
  const auto summary = WriteTracks(Options("a"), nullptr);
  ASSERT_TRUE(summary.ok()) << summary.status();
  for (const char* file : {"log/tracks.csv", "truth/tracks.csv"}) {
    const auto rows = ReadRows("a", file);
    EXPECT_EQ(Read("a", file).substr(0, sizeof(kTracksHeader)), std::string(kTracksHeader) + "\n");
    std::map<std::string, int64_t> last;
    std::pair<int64_t, std::string> previous{-1, ""};
    for (size_t i = 1; i < rows.size(); ++i) {
      ASSERT_EQ(rows[i].size(), 10u);
      int64_t time_ns = -1;
      ASSERT_TRUE(absl::SimpleAtoi(rows[i][0], &time_ns));
      const std::pair<int64_t, std::string> key{time_ns, rows[i][1]};
      ASSERT_LT(previous, key) << file << " row " << i;
      previous = key;
      const auto [entry, is_new] = last.emplace(rows[i][1], time_ns);
      if (!is_new) {
        ASSERT_GT(time_ns, entry->second);
      }
      entry->second = time_ns;
      EXPECT_EQ(rows[i][2], rows[i][1] == "robot" ? "robot" : "human");
      const Pose3d pose{
          {Number(rows[i][3]), Number(rows[i][4]), Number(rows[i][5])},
          {Number(rows[i][9]), Number(rows[i][6]), Number(rows[i][7]), Number(rows[i][8])}};
      ASSERT_TRUE(IsValidPose(pose)) << file << " row " << i;
    }
    EXPECT_EQ(last.size(), 4u);
  }
}

TEST_F(TracksLog, MatchesItsTruthButForNoiseAndGaps) {
  TracksOptions options = Options("a");
  options.crowd.duration_s = 300.0;
  const auto summary = WriteTracks(options, nullptr);
  ASSERT_TRUE(summary.ok()) << summary.status();
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> truth;
  const auto truth_rows = ReadRows("a", "truth/tracks.csv");
  for (size_t i = 1; i < truth_rows.size(); ++i) {
    truth[{truth_rows[i][0], truth_rows[i][1]}] = truth_rows[i];
  }
  EXPECT_EQ(truth.size(), 4u * 3000u);
  EXPECT_EQ(summary->truth_pose_count, static_cast<int64_t>(truth.size()));
  const auto rows = ReadRows("a", "log/tracks.csv");
  EXPECT_EQ(summary->pose_count, static_cast<int64_t>(rows.size() - 1));
  EXPECT_LT(summary->pose_count, summary->truth_pose_count);
  EXPECT_GT(summary->gap_count, 0);
  double squares = 0.0;
  for (size_t i = 1; i < rows.size(); ++i) {
    const auto found = truth.find({rows[i][0], rows[i][1]});
    ASSERT_NE(found, truth.end()) << "row " << i;
    for (size_t axis = 3; axis < 6; ++axis) {
      squares += std::pow(Number(rows[i][axis]) - Number(found->second[axis]), 2);
    }
  }
  const double count = 3.0 * static_cast<double>(rows.size() - 1);
  EXPECT_NEAR(std::sqrt(squares / count), options.sensor.position_noise_m, 0.0005);
}

TEST_F(TracksLog, PresenceTilesTheRecordingOfEachAgent) {
  const auto summary = WriteTracks(Options("a"), nullptr);
  ASSERT_TRUE(summary.ok());
  const auto rows = ReadRows("a", "truth/presence.csv");
  EXPECT_EQ(summary->visit_count, static_cast<int64_t>(rows.size() - 1));
  const auto map = DeltaFromJson(Read("a", "log/map.json"));
  ASSERT_TRUE(map.ok()) << map.status();
  std::map<std::string, std::string> room_names;
  for (const Node& node : map->nodes) {
    if (node.kind == kinds::kRoom) room_names[ToString(node.id)] = node.name;
  }
  std::map<std::string, std::string> end;
  for (size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 5u);
    EXPECT_EQ(room_names[rows[i][1]], rows[i][2]);
    const auto [entry, is_new] = end.emplace(rows[i][0], "0");
    EXPECT_EQ(rows[i][3], entry->second) << "row " << i;
    entry->second = rows[i][4];
  }
  EXPECT_EQ(end.size(), 4u);
  for (const auto& [agent, exit_ns] : end) EXPECT_EQ(exit_ns, "60000000000") << agent;
}

TEST_F(TracksLog, PeopleTakeThingsAwayOnlyIfAsked) {
  TracksOptions options = Options("none");
  options.world.seed = 12;
  options.crowd = {40, 150.0};
  options.sensor.rate_hz = 1.0;
  ASSERT_TRUE(WriteTracks(options, nullptr).ok());
  EXPECT_EQ(ReadRows("none", "truth/picks.csv").size(), 1u);
  EXPECT_EQ(Read("none", "log/map.json").find("valid_to_ns"), std::string::npos);

  options.out = (folder_ / "some").string();
  options.pick_count = 3;
  const auto some = WriteTracks(options, nullptr);
  ASSERT_TRUE(some.ok()) << some.status();
  EXPECT_EQ(some->pick_count, 3);
  const auto rows = ReadRows("some", "truth/picks.csv");
  ASSERT_EQ(rows.size(), 4u);
  const std::string map = Read("some", "log/map.json");
  std::set<std::string> objects;
  for (size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 7u);
    objects.insert(rows[i][1]);
    EXPECT_LT(std::stoll(rows[i][4]), std::stoll(rows[i][5]));
    EXPECT_LT(std::stoll(rows[i][5]), std::stoll(rows[i][6]));
    EXPECT_NE(map.find(rows[i][6]), std::string::npos) << rows[i][6];
  }
  EXPECT_EQ(objects.size(), 3u);
  // More than people stand beside.
  options.out = (folder_ / "many").string();
  options.pick_count = 1000;
  const auto many = WriteTracks(options, nullptr);
  ASSERT_TRUE(many.ok()) << many.status();
  EXPECT_GT(many->pick_count, 3);
  EXPECT_LT(many->pick_count, 1000);
  EXPECT_EQ(ReadRows("many", "truth/picks.csv").size(), static_cast<size_t>(many->pick_count) + 1);
  // Who walks where is the same as without.
  EXPECT_EQ(Read("none", "log/tracks.csv"), Read("some", "log/tracks.csv"));
}

TEST_F(TracksLog, RefusesAFolderThatHoldsSomethingUnlessForced) {
  TracksOptions options = Options("a");
  fs::create_directories(options.out);
  ASSERT_TRUE(WriteTracks(options, nullptr).ok()) << "an empty folder is fine";
  std::ofstream(folder_ / "a" / "notes.txt") << "mine";
  const std::string before = Read("a", "log/tracks.csv");
  options.crowd.people_count = 1;
  const auto refused = WriteTracks(options, nullptr);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_NE(std::string(refused.status().message()).find(options.out), std::string::npos);
  EXPECT_TRUE(Read("a", "log/tracks.csv") == before);
  options.force = true;
  ASSERT_TRUE(WriteTracks(options, nullptr).ok());
  EXPECT_TRUE(Read("a", "log/tracks.csv") != before);
  EXPECT_EQ(Read("a", "notes.txt"), "mine");
}

TEST_F(TracksLog, RefusesAFileInPlaceOfAFolderAndBadOptions) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "a") << "a file";
  EXPECT_EQ(ReasonOf(WriteTracks(Options("a"), nullptr).status()), Reason::kFieldInvalid);
  TracksOptions options = Options("b");
  options.sensor.rate_hz = 0.0;
  EXPECT_EQ(ReasonOf(WriteTracks(options, nullptr).status()), Reason::kFieldInvalid);
  EXPECT_FALSE(fs::exists(options.out));
}

TEST_F(TracksLog, RefusesALogLargerThanTheDiskBeforeWritingAnything) {
  TracksOptions options = Options("a");
  options.crowd = {10'000, 86'400.0};
  options.sensor.rate_hz = 200.0;
  EXPECT_EQ(ReasonOf(WriteTracks(options, nullptr).status()), Reason::kDiskFull);
  EXPECT_FALSE(fs::exists(options.out));
}

TEST_F(TracksLog, SimulatesTheRobotAloneAndReportsProgressUpToOne) {
  TracksOptions options = Options("a");
  options.crowd.people_count = 0;
  double last = 0.0;
  const auto summary = WriteTracks(options, [&](double share) {
    EXPECT_GT(share, last);
    last = share;
  });
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->pose_count, 600);
  EXPECT_EQ(last, 1.0);
  for (const auto& entry : fs::recursive_directory_iterator(options.out)) {
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
  }
}

}  // namespace
}  // namespace dsg::simulator
