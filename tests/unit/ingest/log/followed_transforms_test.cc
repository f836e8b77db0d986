// SPDX-License-Identifier: Apache-2.0
// Poses of /tf while the bag is written: those of the finished bag, or left out and counted.
#include "ingest/log/followed_transforms.h"

#include <atomic>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/follow_test_util.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

// How a drive is recorded.
struct Drive {
  TimeNs length_ns = 8 * kNsPerSecond;
  /// Of the transforms against the sensors.
  TimeNs clock_ns = 0;
  /// From the stamp of a transform of the map to when it is recorded.
  TimeNs map_late_ns = 150 * kMillisecond;
  TimeNs map_period_ns = 143 * kMillisecond;
  /// When the last transforms are of.
  TimeNs map_end_ns = kTimeMax;
  TimeNs base_end_ns = kTimeMax;
  /// How fast the map drifts against the odometry, m / s.
  double drift_m_s = 0.1;
};

// A camera at 10 Hz, an inertial unit at 50 Hz, odometry at 30 Hz, and the map it drifts in.
Recording RecordDrive(const Drive& drive) {
  Recording recording;
  recording.push_back({"/tf_static", "tf2_msgs/TFMessage", kT0,
                       TransformsFields(CdrWriter(), {"left_cam", "right_cam"})});
  recording.push_back({"/tesse/left_cam/camera_info", "sensor_msgs/CameraInfo", kT0,
                       CameraInfoFields(CdrWriter(), 2, 1, 415.7, "left_cam")});
  for (TimeNs t = 0; t < drive.length_ns; t += 20 * kMillisecond) {
    const TimeNs at_ns = kT0 + t;
    recording.push_back({"/tesse/imu/noisy/imu", "sensor_msgs/Imu", at_ns + kMillisecond,
                         ImuFields(CdrWriter(), at_ns, 0.1, 9.81)});
    if (t % (100 * kMillisecond) != 0) continue;
    recording.push_back({"/tesse/left_cam/mono/image_raw", "sensor_msgs/Image",
                         at_ns + 30 * kMillisecond,
                         ImageFields(CdrWriter(), at_ns, "mono8", 2, 1, 2, "ab")});
  }
  for (TimeNs t = 5 * kMillisecond; t < std::min(drive.length_ns, drive.base_end_ns);
       t += 33 * kMillisecond) {
    const double x = 1e-9 * static_cast<double>(t);
    const double half_turn = 0.05 * x;
    recording.push_back(
        {"/tf", "tf2_msgs/TFMessage", kT0 + t + 4 * kMillisecond,
         TfMessage({{"odom",
                     "base_link_gt",
                     kT0 + drive.clock_ns + t,
                     {x, 0.5 * x, 0, 0, 0, std::sin(half_turn), std::cos(half_turn)}}})});
  }
  for (TimeNs t = 0; t < std::min(drive.length_ns, drive.map_end_ns); t += drive.map_period_ns) {
    const double x = drive.drift_m_s * 1e-9 * static_cast<double>(t);
    recording.push_back({"/tf", "tf2_msgs/TFMessage", kT0 + t + drive.map_late_ns,
                         TfMessage({{"map",
                                     "odom",
                                     kT0 + drive.clock_ns + t,
                                     {x, 7, 0, 0, 0, std::sin(x), std::cos(x)}}})});
  }
  std::stable_sort(
      recording.begin(), recording.end(),
      [](const RecordedMessage& a, const RecordedMessage& b) { return a.time_ns < b.time_ns; });
  return recording;
}

absl::StatusOr<WholeLog> Follow(const Recording& recording) {
  const TempFolder folder;
  return ReadAllWithEnd(folder.Write("log.mcap", WriteMcap(recording)), Following(milliseconds(0)));
}

// At a time of recording, before what is recorded then.
void Insert(TimeNs time_ns, const Tf& transform, Recording* recording) {
  const auto at = std::find_if(recording->begin(), recording->end(),
                               [&](const RecordedMessage& any) { return any.time_ns >= time_ns; });
  recording->insert(at, {"/tf", "tf2_msgs/TFMessage", time_ns, TfMessage({transform})});
}

void ExpectInOrder(const WholeLog& log) {
  for (size_t i = 1; i < log.order.size(); ++i) {
    ASSERT_LE(log.order[i - 1].second, log.order[i].second) << i;
  }
}

TEST(FollowedTransforms, GiveWhatTheFinishedFileGives) {
  for (const TimeNs late_ns : {TimeNs{0}, 150 * kMillisecond, 2500 * kMillisecond}) {
    for (const std::string compression : {"zstd", "plain"}) {
      SCOPED_TRACE(absl::StrCat(compression, " late by ", late_ns / kMillisecond, " ms"));
      const TempFolder folder;
      const std::string bytes = WriteMcap(RecordDrive({.map_late_ns = late_ns}),
                                          {.compression = compression, .messages_per_chunk = 37});
      const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
      ASSERT_TRUE(whole.ok()) << whole.status();
      ASSERT_EQ(whole->poses.size(), 243u);
      const std::string path = folder.Write("log.mcap", "");
      const SlowWriter writer(path, bytes, 4000);
      const auto followed = ReadAll(path, Following(milliseconds(60'000)));
      ASSERT_TRUE(followed.ok()) << followed.status();
      EXPECT_EQ(followed->order, whole->order);
      EXPECT_EQ(followed->info.first_ns, whole->info.first_ns);
      ExpectSamePoses(*followed, *whole);
      EXPECT_TRUE(HasNote(followed->info, "external: /tf, frame \"base_link_gt\" in \"map\""));
      EXPECT_TRUE(followed->info.channel_counts.contains("poses"));
      const CameraCalibration* const camera = followed->info.rig.FindCamera("cam0");
      ASSERT_NE(camera, nullptr);
      EXPECT_EQ(camera->body_T_camera.position,
                whole->info.rig.FindCamera("cam0")->body_T_camera.position);
    }
  }
}

TEST(FollowedTransforms, AreTheSameLogHoweverMuchWasThere) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(RecordDrive({}));
  const auto identity = [&](const std::string& some) {
    const auto log = OpenLog(folder.Write("log.mcap", some), Following(milliseconds(0)));
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? (*log)->info().content_sha256 : "";
  };
  const std::string all = identity(bytes);
  for (const double part : {0.5, 0.7, 0.99}) {
    EXPECT_EQ(
        identity(bytes.substr(0, static_cast<size_t>(part * static_cast<double>(bytes.size())))),
        all);
  }
  EXPECT_NE(identity(WriteMcap(RecordDrive({.drift_m_s = 0.2}))), all);
  EXPECT_NE(ReadAll(folder.Write("log.mcap", bytes))->info.content_sha256, all);
}

TEST(FollowedTransforms, LeaveOutPosesWhoseTransformsNeverCome) {
  const TimeNs map_end_ns = 6 * kNsPerSecond;
  const auto log = Follow(RecordDrive({.length_ns = 30 * kNsPerSecond, .map_end_ns = map_end_ns}));
  ASSERT_TRUE(log.ok()) << log.status();
  ExpectInOrder(*log);
  EXPECT_EQ(log->ImageCount("cam0"), 300);
  EXPECT_EQ(log->imu.size(), 1500u);
  // Those before the end of the map, and those that still waited at the end of the file, over which
  // it stands as in a finished one.
  const int64_t total = (30'000 - 5 + 32) / 33;
  const auto given = std::ssize(log->poses);
  const int64_t before = std::count_if(
      log->poses.begin(), log->poses.end(),
      [&](const PoseMeasurement& pose) { return pose.pose.time_ns < kT0 + map_end_ns; });
  EXPECT_GT(before, 170);
  EXPECT_NEAR(static_cast<double>(given - before), 303.0, 10.0);
  EXPECT_TRUE(HasNote(log->info, absl::StrCat(total - given,
                                              " poses of /tf are left out: the "
                                              "transforms above them did not come")))
      << total << " " << given;
}

TEST(FollowedTransforms, LetImagesGoWhenPosesNeverCome) {
  const auto log =
      Follow(RecordDrive({.length_ns = 30 * kNsPerSecond, .base_end_ns = 5 * kNsPerSecond}));
  ASSERT_TRUE(log.ok()) << log.status();
  ExpectInOrder(*log);
  EXPECT_EQ(log->ImageCount("cam0"), 300);
  EXPECT_EQ(log->poses.size(), 152u);
  EXPECT_FALSE(HasNote(log->info, "left out"));
}

TEST(FollowedTransforms, TakeAFrameThatHasNotMovedToStand) {
  const TempFolder folder;
  // Told once, and twice; then no more.
  for (const TimeNs map_end_ns : {kMillisecond, 200 * kMillisecond}) {
    const std::string bytes = WriteMcap(
        RecordDrive({.length_ns = 25 * kNsPerSecond, .map_end_ns = map_end_ns, .drift_m_s = 0.0}));
    const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
    const auto followed =
        ReadAllWithEnd(folder.Write("log.mcap", bytes), Following(milliseconds(0)));
    ASSERT_TRUE(whole.ok() && followed.ok()) << whole.status() << followed.status();
    EXPECT_EQ(followed->order, whole->order);
    ExpectSamePoses(*followed, *whole);
    // Nobody waits for a frame that came once: the rest of this file waits for a second only.
    const auto cut = ReadAllWithEnd(folder.Write("log.mcap", bytes.substr(0, bytes.size() / 2)),
                                    Following(milliseconds(0)));
    ASSERT_TRUE(cut.ok()) << cut.status();
    const TimeNs wait_ns = cut->images.back().time_ns - cut->poses.back().pose.time_ns;
    EXPECT_EQ(wait_ns < 2 * kNsPerSecond, map_end_ns == kMillisecond) << wait_ns;
  }
}

TEST(FollowedTransforms, SayWhenTheyAreOfAnotherClock) {
  const auto log =
      Follow(RecordDrive({.length_ns = 20 * kNsPerSecond, .clock_ns = -5000 * kNsPerSecond}));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->ImageCount("cam0"), 200);
  EXPECT_TRUE(HasNote(log->info, "do they share a clock?"));
  // The other way round it is as with topics.
  ExpectMalformedFile(
      Follow(RecordDrive({.length_ns = 20 * kNsPerSecond, .clock_ns = 5000 * kNsPerSecond}))
          .status(),
      {"more than 1 s before", "do they share a clock?"});
}

TEST(FollowedTransforms, PassOverJumpsOfTheirClock) {
  Recording recording = RecordDrive({});
  const TempFolder folder;
  Insert(kT0 + 5 * kNsPerSecond, {"odom", "base_link_gt", kT0 + 2 * kNsPerSecond}, &recording);
  Insert(kT0 + 6 * kNsPerSecond, {"map", "odom", kT0 + 3 * kNsPerSecond}, &recording);
  const std::string bytes = WriteMcap(recording);
  const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
  const auto followed = Follow(recording);
  ASSERT_TRUE(whole.ok() && followed.ok()) << whole.status() << followed.status();
  EXPECT_TRUE(HasNote(followed->info, "2 transforms of /tf are no pose, or have a stamp"));
  ExpectSamePoses(*followed, *whole);
}

TEST(FollowedTransforms, RefuseACircleAndTwoParentsWhenTheyCome) {
  const auto refuse = [](const Tf& transform, const std::vector<std::string>& words) {
    Recording recording = RecordDrive({});
    Insert(kT0 + 5 * kNsPerSecond, transform, &recording);
    const TempFolder folder;
    const std::string path = folder.Write("log.mcap", WriteMcap(recording));
    ExpectMalformedFile(ReadAll(path).status(), words);
    const auto log = OpenLog(path, Following(milliseconds(0)));
    ASSERT_TRUE(log.ok()) << log.status();
    ExpectMalformedFile(ReadOn(**log).status(), words);
  };
  const TimeNs t = kT0 + 5 * kNsPerSecond;
  refuse({"base_link_gt", "map", t}, {"circle", "\"base_link_gt\" in \"odom\" in \"map\" in"});
  refuse({"world", "odom", t}, {"\"odom\"", "\"map\"", "\"world\"", "one parent"});
  // And in the begin, before anything is read.
  Recording recording = RecordDrive({});
  Insert(kT0 + kNsPerSecond, {"base_link_gt", "map", t}, &recording);
  const TempFolder folder;
  ExpectMalformedFile(
      OpenLog(folder.Write("log.mcap", WriteMcap(recording)), Following(milliseconds(0))).status(),
      {"circle"});
}

TEST(FollowedTransforms, SayThatTheRootCameToBeInAnotherFrame) {
  Recording recording = RecordDrive({});
  Insert(kT0 + 5 * kNsPerSecond, {"earth", "map", kT0 + 5 * kNsPerSecond}, &recording);
  const TempFolder folder;
  std::vector<std::string> told;
  LogOptions options = Following(milliseconds(0));
  options.follow->tell = [&told](const std::string& sentence) { told.push_back(sentence); };
  const auto log = ReadAllWithEnd(folder.Write("log.mcap", WriteMcap(recording)), options);
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("frame \"map\" came to be in \"earth\" later than 3 s"), std::string::npos)
      << told[0];
  EXPECT_TRUE(HasNote(log->info, told[0]));
  EXPECT_EQ(log->poses.size(), 243u);
}

TEST(FollowedTransforms, LeaveWhatWaitsForTheNextRunWhenStopped) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(RecordDrive({}));
  std::atomic<bool> stop = false;
  LogOptions options = Following(milliseconds(60'000), &stop);
  const auto log =
      OpenLog(folder.Write("log.mcap", bytes.substr(0, bytes.size() * 3 / 4)), options);
  ASSERT_TRUE(log.ok()) << log.status();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE((*log)->Next()->has_value()) << i;
  stop = true;
  const auto rest = ReadOn(**log);
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_TRUE(rest->order.empty());
}

TEST(FollowedTransforms, AloneAreALogWithoutSensors) {
  Recording recording = RecordDrive({});
  std::erase_if(recording, [](const RecordedMessage& message) { return message.topic != "/tf"; });
  const TempFolder folder;
  const std::string bytes = WriteMcap(recording);
  const auto whole = ReadAll(folder.Write("whole.mcap", bytes));
  const auto followed = ReadAllWithEnd(folder.Write("log.mcap", bytes), Following(milliseconds(0)));
  ASSERT_TRUE(whole.ok() && followed.ok()) << whole.status() << followed.status();
  ExpectSamePoses(*followed, *whole);
  // Without its end, a pose waits for the transforms above it.
  const auto cut = ReadAllWithEnd(folder.Write("log.mcap", bytes.substr(0, bytes.size() * 3 / 4)),
                                  Following(milliseconds(0)));
  ASSERT_TRUE(cut.ok()) << cut.status();
  ASSERT_GT(cut->poses.size(), 100u);
  EXPECT_TRUE(HasNote(cut->info, "at the end are not read: they wait for transforms"));
  for (size_t i = 0; i < cut->poses.size(); ++i) {
    EXPECT_EQ(cut->poses[i].pose.map_T_agent.position, whole->poses[i].pose.map_T_agent.position);
  }
}

TEST(FollowedTransforms, SurviveDamage) {
  const TempFolder folder;
  const std::string bytes = WriteMcap(RecordDrive({.length_ns = 5 * kNsPerSecond}),
                                      {.compression = "plain", .has_checksums = false});
  constexpr unsigned kSeed = 13;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  int read_count = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes;
    if (i % 2 == 0) {
      damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    } else {
      damaged.resize(random() % damaged.size());
    }
    const auto log = ReadAllWithEnd(folder.Write("log.mcap", damaged), Following(milliseconds(0)));
    if (log.ok()) {
      ++read_count;
      ExpectInOrder(*log);
    } else {
      EXPECT_NE(log.status().message().find("log.mcap"), std::string::npos) << log.status();
    }
  }
  EXPECT_GT(read_count, 20);
}

}  // namespace
}  // namespace dsg::ingest
