// SPDX-License-Identifier: Apache-2.0
// Recordings of ROS 2 as logs: the same messages give the same log, whatever file they are in.
#include <random>

#include "absl/strings/str_cat.h"
#include "ingest/log/db3_file.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

std::string AllNotes(const LogInfo& info) {
  std::string notes;
  for (const std::string& note : info.notes) notes += note + "\n";
  return notes;
}

void ExpectSameLog(const WholeLog& a, const WholeLog& b) {
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.info.channel_counts, b.info.channel_counts);
  EXPECT_EQ(a.info.first_ns, b.info.first_ns);
  ASSERT_EQ(a.imu.size(), b.imu.size());
  for (size_t i = 0; i < a.imu.size(); ++i) {
    EXPECT_EQ(a.imu[i].angular_velocity_rad_s, b.imu[i].angular_velocity_rad_s);
    EXPECT_EQ(a.imu[i].acceleration_m_s2, b.imu[i].acceleration_m_s2);
  }
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].pose.map_T_agent.position, b.poses[i].pose.map_T_agent.position);
  }
  ASSERT_EQ(a.images.size(), b.images.size());
  for (size_t i = 0; i < a.images.size(); ++i) {
    EXPECT_EQ(a.images[i].load()->bytes, b.images[i].load()->bytes);
  }
  ASSERT_EQ(a.info.rig.cameras.size(), b.info.rig.cameras.size());
  for (size_t i = 0; i < a.info.rig.cameras.size(); ++i) {
    EXPECT_EQ(a.info.rig.cameras[i].fx, b.info.rig.cameras[i].fx);
    EXPECT_EQ(a.info.rig.cameras[i].body_T_camera.position,
              b.info.rig.cameras[i].body_T_camera.position);
    EXPECT_EQ(a.info.rig.cameras[i].distortion_coefficients,
              b.info.rig.cameras[i].distortion_coefficients);
  }
}

TEST(Ros2Bag, GivesTheLogThatTheRos1BagGives) {
  const TempFolder folder;
  const Recording cdr = SmallRecording(CdrWriter(), 5);
  const auto ros1 = ReadAll(folder.Write("log.bag", WriteBag(SmallRecording(ByteWriter(), 5))));
  ASSERT_TRUE(ros1.ok()) << ros1.status();
  EXPECT_EQ(ros1->images.size(), 15u);
  EXPECT_EQ(ros1->info.rig.cameras.size(), 3u);
  WriteDb3(cdr, folder.Path("log.db3"));
  const std::pair<std::string, std::string> others[] = {
      {folder.Write("zstd.mcap", WriteMcap(cdr)), "mcap"},
      {folder.Write("lz4.mcap", WriteMcap(cdr, {.compression = "lz4"})), "mcap"},
      {folder.Write("plain.mcap", WriteMcap(cdr, {.compression = "plain"})), "mcap"},
      {folder.Write("big_endian.mcap", WriteMcap(SmallRecording(CdrWriter(true), 5))), "mcap"},
      {folder.Write("ros1.mcap", WriteMcap(SmallRecording(ByteWriter(), 5), {.encoding = "ros1"})),
       "mcap"},
      {folder.Path("log.db3"), "rosbag2"}};
  for (const auto& [path, format] : others) {
    SCOPED_TRACE(path);
    const auto log = ReadAll(path);
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, format);
    ExpectSameLog(*log, *ros1);
    EXPECT_EQ(log->info.content_sha256, ros1->info.content_sha256);
    LogOptions options;
    options.format = format;
    EXPECT_TRUE(ReadAll(path, options).ok());
    options.format = "rosbag";
    ExpectMalformedFile(ReadAll(path, options).status(), {format, "not rosbag"});
  }
}

TEST(Ros2Bag, IsTheSameLogAsLongAsNothingThatIsReadDiffers) {
  const TempFolder folder;
  const auto hash_of = [&](const Recording& recording) {
    const auto log = ReadAll(folder.Write("log.mcap", WriteMcap(recording)));
    EXPECT_TRUE(log.ok()) << log.status();
    return log->info.content_sha256;
  };
  const Recording recording = SmallRecording(CdrWriter(), 5);
  const std::string hash = hash_of(recording);
  Recording with_others = recording;
  with_others.push_back({"/rosout", "rcl_interfaces/msg/Log", kT0, "anything"});
  EXPECT_EQ(hash_of(with_others), hash);
  // A nanosecond of the stamp behind the four bytes of CDR and the seconds, and a last pixel.
  constexpr size_t kStampAt = 8;
  for (size_t i = 0; i < recording.size(); ++i) {
    const RecordedMessage& message = recording[i];
    if (message.type == "std_msgs/String" || message.time_ns == kT0) continue;
    std::vector<size_t> places = {kStampAt};
    if (message.type == "sensor_msgs/Image") places.push_back(message.data.size() - 1);
    for (const size_t at : places) {
      Recording changed = recording;
      changed[i].data[at] = static_cast<char>(changed[i].data[at] ^ 1);
      EXPECT_NE(hash_of(changed), hash) << message.topic << " byte " << at;
    }
  }
}

// As AMCL publishes it; two topics of other uses must not hide it.
TEST(Ros2Bag, TakesPosesWithCovariance) {
  const auto record = [](const auto& empty) {
    Recording recording;
    const auto add = [&](const std::string& topic, TimeNs t, double x) {
      recording.push_back({topic, "geometry_msgs/PoseWithCovarianceStamped", t,
                           PoseWithCovarianceFields(empty, t, {x, 2, 3, 0, 0, 0.6, 0.8})});
    };
    add("/initialpose", kT0, 9);
    for (int i = 0; i < 3; ++i) add("/amcl_pose", kT0 + i, 1.0 + i);
    return recording;
  };
  const TempFolder folder;
  const std::string ros2 = folder.Write("log.mcap", WriteMcap(record(CdrWriter())));
  for (const std::string& path : {ros2, folder.Write("log.bag", WriteBag(record(ByteWriter())))}) {
    SCOPED_TRACE(path);
    const auto log = ReadAll(path);
    ASSERT_TRUE(log.ok()) << log.status();
    ASSERT_EQ(log->poses.size(), 3u);
    const Pose3d& last = log->poses[2].pose.map_T_agent;
    EXPECT_EQ(last.position, Eigen::Vector3d(3, 2, 3));
    EXPECT_TRUE(last.orientation.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6)));
    EXPECT_NE(AllNotes(log->info).find("external: /amcl_pose"), std::string::npos);
  }
  LogOptions options;
  options.topics = {{"truth", "/initialpose"}};
  const auto named = ReadAll(ros2, options);
  ASSERT_TRUE(named.ok()) << named.status();
  ASSERT_EQ(named->poses.size(), 1u);
  EXPECT_EQ(named->poses[0].pose.map_T_agent.position.x(), 9.0);
  Recording cut = record(CdrWriter());
  cut.back().data.resize(cut.back().data.size() - 8);
  ExpectMalformedFile(ReadAll(folder.Write("cut.mcap", WriteMcap(cut))).status(),
                      {"/amcl_pose message 3", "geometry_msgs/PoseWithCovarianceStamped"});
}

class BagFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    const Recording all = SmallRecording(CdrWriter(), 8);
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    // Ten comes after nine.
    WriteDb3({all.begin(), middle}, folder_.Write("bag/run_9.db3", ""));
    WriteDb3({middle, all.end()}, folder_.Write("bag/run_10.db3", ""));
    folder_.Write("split/run_0.mcap", WriteMcap({all.begin(), middle}));
    folder_.Write("split/run_1.mcap", WriteMcap({middle, all.end()}));
    WriteList("run_0.mcap", "run_1.mcap");
    whole_ = folder_.Write("whole.mcap", WriteMcap(all));
  }
  void WriteList(const std::string& first, const std::string& second,
                 const std::string& compression = "") const {
    folder_.Write("split/metadata.yaml",
                  absl::StrCat("rosbag2_bagfile_information:\n  version: 5\n",
                               "  compression_mode: \"", compression, "\"\n",
                               "  relative_file_paths:\n    - ", first, "\n    - ", second, "\n"));
  }
  TempFolder folder_;
  std::string whole_;
};

TEST_F(BagFolderTest, IsOneLog) {
  const auto whole = ReadAll(whole_);
  ASSERT_TRUE(whole.ok()) << whole.status();
  for (const char* const name : {"bag", "split"}) {
    const auto log = ReadAll(folder_.Path(name));
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, "rosbag2");
    ExpectSameLog(*log, *whole);
  }
  // Older recorders put the name of the folder before those of the files.
  WriteList("split/run_0.mcap", "split/run_1.mcap");
  EXPECT_TRUE(ReadAll(folder_.Path("split")).ok());
}

TEST_F(BagFolderTest, NamesWhatIsMissing) {
  WriteList("run_0.mcap", "run_2.mcap");
  ExpectMalformedFile(ReadAll(folder_.Path("split")).status(),
                      {"run_2.mcap", "not there", "ros2 bag reindex"});
  WriteList("run_0.mcap", "run_1.mcap", "FILE");
  ExpectMalformedFile(ReadAll(folder_.Path("split")).status(), {"compressed", "ros2 bag convert"});
  folder_.Write("split/metadata.yaml", "rosbag2_bagfile_information: [\n");
  ExpectMalformedFile(ReadAll(folder_.Path("split")).status(), {"metadata.yaml", "YAML"});
  folder_.Write("split/metadata.yaml", "rosbag2_bagfile_information: " + std::string(9999, '['));
  ExpectMalformedFile(ReadAll(folder_.Path("split")).status(), {"metadata.yaml", "nests too deep"});
  folder_.Write("split/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
  ExpectMalformedFile(ReadAll(folder_.Path("split")).status(), {"relative_file_paths"});
}

TEST(Ros2Bag, UnpacksMessagesThatAreCompressedOneByOne) {
  const TempFolder folder;
  Recording recording = SmallRecording(CdrWriter(), 3);
  const auto plain = ReadAll(folder.Write("plain.mcap", WriteMcap(recording)));
  ASSERT_TRUE(plain.ok()) << plain.status();
  for (RecordedMessage& message : recording) {
    std::string packed(ZSTD_compressBound(message.data.size()), '\0');
    packed.resize(
        ZSTD_compress(packed.data(), packed.size(), message.data.data(), message.data.size(), 1));
    message.data = packed;
  }
  const auto log = ReadAll(folder.Write("log.mcap", WriteMcap(recording)));
  ASSERT_TRUE(log.ok()) << log.status();
  ExpectSameLog(*log, *plain);
  recording[3].data.resize(recording[3].data.size() - 3);
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", WriteMcap(recording))).status(),
                      {"topic /tesse/left_cam/mono/image_raw", "cut short"});
}

TEST(Ros2Bag, PassesOverWhatItCannotRead) {
  const TempFolder folder;
  Recording recording = SmallRecording(CdrWriter(), 2);
  recording.push_back(
      {"/imu0", "sensor_msgs/Image", kT0, ImageFields(CdrWriter(), kT0, "mono8", 1, 1, 1, "x")});
  const auto log = ReadAll(folder.Write("log.mcap", WriteMcap(recording)));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_NE(AllNotes(log->info).find("/chatter (2 std_msgs/String)"), std::string::npos);
  // All topics are in a form that is not read, and the log says which.
  const auto json =
      OpenLog(folder.Write("json.mcap", WriteMcap(recording, {.encoding = "json"})), {});
  ASSERT_TRUE(json.ok()) << json.status();
  ExpectMalformedFile((*json)->Next().status(),
                      {"no topic that can be used", "sensor_msgs/Imu [json]"});
}

TEST(Ros2Bag, SaysThatAKnownTopicIsOfAnotherType) {
  const TempFolder folder;
  Recording recording;
  recording.push_back({"/imu0", "std_msgs/String", kT0, StringFields(CdrWriter(), "no samples")});
  recording.push_back({"/cam0/image_raw", "sensor_msgs/Image", kT0,
                       ImageFields(CdrWriter(), kT0, "mono8", 1, 1, 1, "x")});
  const auto log = ReadAll(folder.Write("log.mcap", WriteMcap(recording)));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_NE(AllNotes(log->info).find("/imu0 is not read: it has messages of std_msgs/String, "
                                     "sensor_msgs/Imu is due"),
            std::string::npos)
      << AllNotes(log->info);
  // Bytes of another type than the topic has.
  recording[0] = {"/imu0", "sensor_msgs/Imu", kT0, StringFields(CdrWriter(), "no samples")};
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", WriteMcap(recording))).status(),
                      {"/imu0 message 1", "too short for sensor_msgs/Imu"});
}

TEST(Ros2Bag, NamesStampsThatStepBackAndOtherClocks) {
  const TempFolder folder;
  Recording recording;
  for (const TimeNs t : {10, 30, 20}) {
    recording.push_back({"/imu0", "sensor_msgs/Imu", 100, ImuFields(CdrWriter(), kT0 + t, 0, 0)});
  }
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", WriteMcap(recording))).status(),
                      {"/imu0", "message 3", absl::StrCat(kT0 + 20), absl::StrCat(kT0 + 30)});
  recording.clear();
  for (int i = 0; i < 2; ++i) {
    recording.push_back({"/imu0", "sensor_msgs/Imu", 100, ImuFields(CdrWriter(), 0, 0, 0)});
  }
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", WriteMcap(recording))).status(),
                      {"/imu0", "message 2", "stamp 0", "does not stamp"});
  recording = SmallRecording(CdrWriter(), 40);
  recording.push_back({"/tesse/imu/noisy/imu", "sensor_msgs/Imu", kT0 + 9 * kNsPerSecond,
                       ImuFields(CdrWriter(), 5 * kNsPerSecond, 0, 0)});
  ExpectMalformedFile(ReadAll(folder.Write("log.mcap", WriteMcap(recording))).status(),
                      {"/tesse/imu/noisy/imu", "stamp 5000000000"});
}

TEST(Db3File, NamesWhatIsWrong) {
  const TempFolder folder;
  const auto expect = [&](const std::string& sql, const std::vector<std::string>& parts) {
    const std::string path = folder.Path("log.db3");
    std::filesystem::remove(path);
    RunSql(path, sql);
    ExpectMalformedFile(Db3File::Open(path).status(), parts);
  };
  expect("CREATE TABLE graph(id)", {"log.db3", "without a table topics", "no bag of ROS 2"});
  expect(
      "CREATE TABLE topics(id, name, type, serialization_format);"
      "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
      "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n",
      {"without a table messages"});
  const std::string tables = kDb3Tables;
  expect(tables + "INSERT INTO messages VALUES (1, 7, 0, x'00')", {"message 1", "topic 7"});
  const std::string topic = tables + "INSERT INTO topics VALUES (1, '/a', 'b/msg/C', 'cdr', '');";
  expect(topic + "INSERT INTO messages VALUES (1, 1, 'noon', x'00')", {"message 1", "no time"});
  expect("CREATE TABLE topics(name); CREATE TABLE messages(id)", {"SQLite says", "no such column"});
}

TEST(Db3File, ReadsChangesThatTheRecorderLeftInItsLog) {
  const TempFolder folder;
  const std::string path = folder.Path("open.db3");
  WriteDb3(SmallRecording(CdrWriter(), 2), path);
  const auto before = Db3File::Open(path);
  ASSERT_TRUE(before.ok()) << before.status();
  sqlite3* recorder = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &recorder), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(recorder,
                         "PRAGMA journal_mode = WAL; INSERT INTO messages(topic_id, timestamp, "
                         "data) VALUES (1, 7, x'00010000')",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  // What a crash leaves behind.
  std::filesystem::copy_file(path, folder.Path("left.db3"));
  std::filesystem::copy_file(path + "-wal", folder.Path("left.db3-wal"));
  sqlite3_close(recorder);
  const auto left = Db3File::Open(folder.Path("left.db3"));
  ASSERT_TRUE(left.ok()) << left.status();
  EXPECT_EQ((*left)->messages().size(), (*before)->messages().size() + 1);
}

TEST(Db3File, SurvivesCutsAndChangedBytes) {
  const TempFolder folder;
  WriteDb3(SmallRecording(CdrWriter(), 30), folder.Path("log.db3"));
  std::ifstream in(folder.Path("log.db3"), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  std::mt19937 random(20240503);
  const auto read = [&](const std::string& bytes) {
    const absl::Status status = ReadAll(folder.Write("changed.db3", bytes)).status();
    EXPECT_TRUE(status.ok() || ReasonOf(status) == Reason::kFileMalformed) << status;
    return status.ok();
  };
  EXPECT_TRUE(read(whole));
  for (size_t size = 16; size < whole.size(); size += 97) EXPECT_FALSE(read(whole.substr(0, size)));
  for (int i = 0; i < 400; ++i) {
    std::string changed = whole;
    const size_t at = 16 + random() % (changed.size() - 16);
    changed[at] = static_cast<char>(changed[at] ^ 1 << random() % 8);
    read(changed);
  }
}

TEST(Db3File, ReadsAMillionTopicsInBoundedTimeAndMessages) {
  const TempFolder folder;
  const std::string path = folder.Path("log.db3");
  RunSql(path, absl::StrCat(
                   kDb3Tables,
                   "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 1000000) "
                   "INSERT INTO topics SELECT i, '/topic' || i, 'sensor_msgs/msg/Image', 'cdr', '' "
                   "FROM n"));
  const auto log = OpenLog(path, {});
  ASSERT_TRUE(log.ok()) << log.status();
  const absl::Status end = (*log)->Next().status();
  ExpectMalformedFile(
      end, {"no topic that can be used", "/topic1 (0 sensor_msgs/Image)", "and 999980 more"});
  EXPECT_LT(end.message().size(), 4000u);
}

}  // namespace
}  // namespace dsg::ingest
