// SPDX-License-Identifier: Apache-2.0
// Whole sensor logs: their files, their bytes, how they are continued, what they refuse.
#include "ingest/simulator/sensors/sensors_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "ingest/simulator/sensors/contact_sheet.h"
#include "ingest/simulator/sensors/image_codec.h"
#include "ingest/simulator/sensors/log_folder.h"
#include "ingest/simulator/sensors/session.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/temp_folder.h"

namespace dsg::simulator {
namespace {

namespace fs = std::filesystem;

// Six pairs with three keyframes: long enough to have an order, short enough to be rendered often.
SensorsOptions SmallOptions() {
  SensorsOptions options;
  options.world = {WorldKind::kApartment, 6};
  options.people_count = 3;
  options.duration_s = 1.5;
  options.rate_hz = 4.0;
  options.keyframe_every = 2;
  return options;
}

// "STAMP" of a frame, as its files are named.
std::string Stamp(int64_t frame) {
  return std::to_string(SmallOptions().BeginNs() + frame * kNsPerSecond / 4);
}

std::map<std::string, std::string> BytesOf(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();
    files[fs::relative(entry.path(), folder).string()] = bytes.str();
  }
  return files;
}

// Compares without printing megabytes.
void ExpectEqualFiles(const std::map<std::string, std::string>& a,
                      const std::map<std::string, std::string>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, bytes] : a) {
    ASSERT_TRUE(b.contains(name)) << name;
    EXPECT_TRUE(bytes == b.at(name)) << name << " differs";
  }
}

class SensorsLog : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }

  absl::StatusOr<SensorsSummary> Write(const std::string& name, SensorsRun run = {},
                                       const SensorsOptions& options = SmallOptions()) {
    run.out = Path(name);
    return WriteSensors(options, run, nullptr);
  }

  const test::TempFolder folder_;
};

TEST_F(SensorsLog, HoldsWhatItsDescriptionSays) {
  const auto summary = Write("a");
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_TRUE(summary->is_finished);
  EXPECT_EQ(summary->frame_count, 6);
  EXPECT_EQ(summary->keyframe_count, 3);
  EXPECT_EQ(summary->imu_count, 301);
  const auto files = BytesOf(Path("a"));
  std::map<std::string, int> counts;
  for (const auto& [name, bytes] : files) {
    EXPECT_FALSE(bytes.empty() && !name.ends_with(".jsonl")) << name;
    ++counts[fs::path(name).parent_path().string()];
  }
  EXPECT_EQ(counts["log/mav0/cam0/data"], 6);
  EXPECT_EQ(counts["log/mav0/cam1/data"], 6);
  for (const char* channel : {"color0", "depth0", "depth0_clean", "label0", "label0_clean"}) {
    EXPECT_EQ(counts[std::string("log/mav0/") + channel + "/data"], 3) << channel;
  }
  for (const char* file :
       {"log/log.json", "log/labels.csv", "log/mav0/imu0/data.csv", "log/mav0/imu0/sensor.yaml",
        "log/mav0/cam0/sensor.yaml", "log/mav0/state_groundtruth_estimate0/data.csv",
        "log/mav0/detections0/data.jsonl", "truth/world.json", "README.txt"}) {
    EXPECT_TRUE(files.contains(file)) << file;
  }
  EXPECT_FALSE(fs::exists(Path("a/.rendering")));
}

TEST_F(SensorsLog, HasTheSameBytesTwiceAndInPieces) {
  ASSERT_TRUE(Write("a", {.thread_count = 1}).ok());
  ASSERT_TRUE(Write("b", {.frames = FrameRange{3, 6}}).ok());
  ASSERT_TRUE(Write("b", {.frames = FrameRange{0, 3}}).ok());
  EXPECT_FALSE(fs::exists(Path("b/log")));
  ASSERT_TRUE(Write("b", {.thread_count = 3}).ok());
  ExpectEqualFiles(BytesOf(Path("a")), BytesOf(Path("b")));
}

TEST_F(SensorsLog, HasATimeOfItsOwn) {
  SensorsOptions other = SmallOptions();
  other.people_count = 2;
  EXPECT_GT(std::abs(other.BeginNs() - SmallOptions().BeginNs()), 3600 * kNsPerSecond);
}

TEST_F(SensorsLog, DiffersFromSeedToSeed) {
  SensorsOptions other = SmallOptions();
  other.world.seed = 7;
  ASSERT_TRUE(Write("a").ok());
  ASSERT_TRUE(Write("b", {}, other).ok());
  const auto a = BytesOf(Path("a/log/mav0/cam0/data"));
  const auto b = BytesOf(Path("b/log/mav0/cam0/data"));
  ASSERT_EQ(a.size(), b.size());
  for (auto i = a.begin(), j = b.begin(); i != a.end(); ++i, ++j) {
    EXPECT_FALSE(i->second == j->second) << i->first;
  }
}

TEST_F(SensorsLog, IsContinuedAfterAFullDisk) {
  ASSERT_TRUE(Write("a").ok());
  const std::string b_data = Path("b/.rendering/log/mav0/cam0/data");
  {
    // Room for each file of the first frame, and for no larger one.
    size_t room = 0;
    for (const auto& [name, bytes] : BytesOf(Path("a/log/mav0"))) {
      if (name.find(Stamp(0) + ".") != std::string::npos) room = std::max(room, bytes.size());
    }
    const test::FullDisk disk(static_cast<int64_t>(room));
    const auto full = Write("b", {.thread_count = 1});
    EXPECT_EQ(ReasonOf(full.status()), Reason::kDiskFull) << full.status();
  }
  EXPECT_FALSE(fs::exists(Path("b/log")));
  const auto first_frame = fs::last_write_time(b_data + "/" + Stamp(0) + ".png");
  ASSERT_TRUE(Write("b").ok());
  EXPECT_EQ(fs::last_write_time(Path("b/log/mav0/cam0/data/" + Stamp(0) + ".png")), first_frame);
  ExpectEqualFiles(BytesOf(Path("a")), BytesOf(Path("b")));
}

TEST_F(SensorsLog, RendersAgainWhatWasCutOff) {
  ASSERT_TRUE(Write("a").ok());
  ASSERT_TRUE(Write("b", {.frames = FrameRange{0, 6}}).ok());
  const std::string image = Path("b/.rendering/log/mav0/cam1/data/" + Stamp(2) + ".png");
  fs::resize_file(image, fs::file_size(image) / 2);
  ASSERT_TRUE(Write("b").ok());
  ExpectEqualFiles(BytesOf(Path("a")), BytesOf(Path("b")));
}

TEST_F(SensorsLog, RefusesToMixOrOverwrite) {
  ASSERT_TRUE(Write("a").ok());
  EXPECT_EQ(Write("a").status().code(), absl::StatusCode::kAlreadyExists);
  ASSERT_TRUE(Write("b", {.frames = FrameRange{0, 1}}).ok());
  SensorsOptions other = SmallOptions();
  other.world.seed = 7;
  EXPECT_EQ(Write("b", {}, other).status().code(), absl::StatusCode::kAlreadyExists);
  fs::create_directories(Path("c"));
  std::ofstream(Path("c/letter.txt")) << "mine";
  EXPECT_EQ(Write("c").status().code(), absl::StatusCode::kAlreadyExists);
  std::ofstream(Path("d")) << "a file";
  EXPECT_EQ(ReasonOf(Write("d").status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Write("e", {.frames = FrameRange{0, 7}}).status()), Reason::kFieldInvalid);
}

TEST_F(SensorsLog, RefusesAnEmptyName) {
  EXPECT_EQ(ReasonOf(WriteSensors(SmallOptions(), {.out = ""}, nullptr).status()),
            Reason::kFieldInvalid);
}

TEST_F(SensorsLog, RemovesNothingThatIsNotItsOwn) {
  for (const char* name : {"log", "truth", ".rendering"}) {
    const std::string home = Path(std::string("home-") + name);
    fs::create_directories(home + "/" + name);
    std::ofstream(home + "/" + name + "/diary") << "mine";
    const auto refused = WriteSensors(SmallOptions(), {.out = home, .force = true}, nullptr);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists) << name;
    EXPECT_TRUE(fs::exists(home + "/" + name + "/diary")) << name;
  }
}

TEST_F(SensorsLog, AddsTheBagToAFinishedLog) {
  ASSERT_TRUE(Write("a").ok());
  const auto image = Path("a/log/mav0/cam0/data/" + Stamp(0) + ".png");
  const auto written = fs::last_write_time(image);
  const auto added = Write("a", {.bag = true});
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_TRUE(added->is_bag_only);
  EXPECT_TRUE(fs::exists(Path("a/log.bag")));
  EXPECT_EQ(fs::last_write_time(image), written);
  EXPECT_EQ(Write("a", {.bag = true}).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(SensorsLog, LetsNobodyFinishWhileAnotherRenders) {
  ASSERT_TRUE(Write("a", {.frames = FrameRange{0, 1}}).ok());
  const LogPaths paths(Path("a"));
  const auto other = FolderLock::Take(paths, false);
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_EQ(Write("a").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(Write("a", {.frames = FrameRange{1, 2}}).ok());
}

TEST_F(SensorsLog, TellsTheTruthOfItself) {
  ASSERT_TRUE(Write("a").ok());
  const auto truth = truth::ReadTruth(Path("a/truth"));
  ASSERT_TRUE(truth.ok()) << truth.status();
  const auto session = SensorSession::Make(SmallOptions());
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(truth->robot.size(), (*session)->imu().size());
  EXPECT_EQ(truth->humans.size(), 3u);
  EXPECT_EQ(truth->human_states.size(), 3u * 3u);
  EXPECT_EQ(truth->objects.size(), (*session)->world().furniture.size());
  EXPECT_EQ(truth->rooms.size(), (*session)->world().plan.rooms.size());
  EXPECT_EQ(truth->face_observed.size(), truth->mesh.faces.size());
  const MotionState motion = (*session)->robot().StateAt((*session)->imu()[100].time_ns);
  EXPECT_LT((truth->robot[100].map_T_body.position - motion.map_T_body.position).norm(), 1e-6);
  // The log's calibration is wrong by a little, the truth's is not.
  const auto* told = (*session)->told_rig().FindCamera("cam0");
  const auto* real = truth->rig.FindCamera("cam0");
  ASSERT_NE(real, nullptr);
  EXPECT_NE(told->fx, real->fx);
  EXPECT_NEAR(told->fx, real->fx, 1.0);
}

TEST_F(SensorsLog, IsShownInPictures) {
  ASSERT_TRUE(Write("a").ok());
  const auto paths = WriteContactSheet(Path("a"), 2, Path("pictures"));
  ASSERT_TRUE(paths.ok()) << paths.status();
  EXPECT_EQ(paths->size(), 5u);
  for (const std::string& path : *paths) EXPECT_GT(fs::file_size(path), 10'000u) << path;
  EXPECT_FALSE(WriteContactSheet(Path("nothing"), 2, Path("pictures")).ok());
  // An image of another size is an error, and no crash.
  const auto depth = Path("a/log/mav0/depth0/data/" + Stamp(2) + ".png");
  ingest::Image small{8, 8, ingest::PixelFormat::kDepth16, std::vector<uint8_t>(128)};
  std::ofstream(depth, std::ios::binary) << *EncodePng(small);
  EXPECT_FALSE(WriteContactSheet(Path("a"), 3, Path("pictures")).ok());
}

}  // namespace
}  // namespace dsg::simulator
