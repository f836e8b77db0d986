// SPDX-License-Identifier: Apache-2.0
// The readers of bags against recorded ones of both ROS and others; counts are those of the data's
// README files.
#include <map>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag.h"
#include "ingest/log/mcap_file.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

class RealBags : public testing::Test {
 protected:
  void SetUp() override {
    if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  static std::string Path(const std::string& name) { return (DataFolder() / name).string(); }
};

struct RealBag {
  const char* path;
  const char* format;
  size_t message_count;
  /// Of some topics.
  std::map<std::string, int64_t> counts;

  friend void PrintTo(const RealBag& bag, std::ostream* out) { *out << bag.path; }
};

class RealBagTest : public RealBags, public testing::WithParamInterface<RealBag> {};

TEST_P(RealBagTest, HasTheCountsOfItsReadmeAndReadsToTheEnd) {
  const auto bag = OpenBagFiles(Path(GetParam().path));
  ASSERT_TRUE(bag.ok()) << bag.status();
  EXPECT_EQ((*bag)->format(), GetParam().format);
  EXPECT_EQ((*bag)->messages().size(), GetParam().message_count);
  std::map<std::string, int64_t> counts;
  for (const BagConnection& connection : (*bag)->connections()) {
    counts[connection.topic] += connection.message_count;
  }
  for (const auto& [topic, count] : GetParam().counts) EXPECT_EQ(counts[topic], count) << topic;
  TimeNs last_ns = kTimeMin;
  for (const BagMessageRef& ref : (*bag)->messages()) {
    EXPECT_GE(ref.bag_time_ns, last_ns);
    last_ns = ref.bag_time_ns;
    const auto message = (*bag)->Read(ref);
    ASSERT_TRUE(message.ok()) << message.status();
    EXPECT_EQ((*bag)->Read(ref, 10)->data.bytes, message->data.bytes.substr(0, 10));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Data, RealBagTest,
    testing::Values(
        RealBag{"bags/nav2_turtlebot.mcap",
                "mcap",
                8197,
                {{"/odom", 2639}, {"/tf", 5422}, {"/tf_static", 1}, {"/amcl_pose", 135}}},
        RealBag{"bags-ros2/sensor_msgs_31types.mcap", "mcap", 194, {}},
        RealBag{"bags-ros2/soccer_goal_12_two_images.mcap", "mcap", 2, {{"/camera/image_raw", 2}}},
        RealBag{"bags-ros2/foxglove_json_camera.mcap", "mcap", 30, {}},
        RealBag{"bags-ros2/foxglove_json_logs.mcap", "mcap", 1111, {}},
        RealBag{"bags-ros2/base_msgs.mcap", "mcap", 3, {}},
        RealBag{"bags-ros2/talker_sqlite3", "rosbag2", 20, {{"/rosout", 10}, {"/topic", 10}}},
        RealBag{"bags-ros2/talker_mcap", "rosbag2", 20, {{"/rosout", 10}, {"/topic", 10}}},
        RealBag{"bags-ros2/split5_sqlite3", "rosbag2", 6074, {}},
        RealBag{"bags-ros2/split5_mcap", "rosbag2", 6074, {}},
        RealBag{"bags-ros2/convert_a_sqlite3",
                "rosbag2",
                150,
                {{"a_empty", 100}, {"b_basictypes", 50}}},
        RealBag{
            "bags-ros2/convert_a_mcap", "rosbag2", 150, {{"a_empty", 100}, {"b_basictypes", 50}}},
        RealBag{"bags-ros2/empty_bag_sqlite3", "rosbag2", 0, {}},
        RealBag{"bags-ros2/tf_example", "rosbag2", 518, {{"/tf", 517}, {"/tf_static", 1}}},
        RealBag{"bags-ros2/pose_imu_battery_a",
                "rosbag2",
                1071,
                {{"/pose", 357}, {"/imu", 357}, {"/battery", 357}}},
        RealBag{"bags-ros2/ros1_husky_imu_odom_gps.bag",
                "rosbag",
                11865 + 3952 + 989,
                {{"/imu/data", 11865}, {"/fix", 989}}},
        RealBag{"bags-ros2/ros1_tilt_laser.bag", "rosbag", 4093, {{"/tf", 711}}},
        RealBag{"bags/example-lz4.bag", "rosbag", 8647, {}}),
    [](const auto& param_info) {
      std::string name = param_info.param.path;
      std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
      return name;
    });

// Topic, time and bytes of each message.
using Content = std::vector<std::tuple<std::string, TimeNs, std::string>>;
Content ContentOf(const Bag& bag) {
  Content content;
  for (const BagMessageRef& ref : bag.messages()) {
    const auto message = bag.Read(ref);
    EXPECT_TRUE(message.ok()) << message.status();
    if (!message.ok()) return content;
    content.emplace_back(bag.connections()[ref.connection].topic, ref.bag_time_ns,
                         std::string(message->data.bytes));
  }
  return content;
}

TEST_F(RealBags, BothStoragesOfOneBagHoldTheSame) {
  for (const std::string name : {"talker", "convert_a", "split5"}) {
    const auto sqlite = OpenBagFiles(Path(absl::StrCat("bags-ros2/", name, "_sqlite3")));
    const auto mcap = OpenBagFiles(Path(absl::StrCat("bags-ros2/", name, "_mcap")));
    ASSERT_TRUE(sqlite.ok()) << sqlite.status();
    ASSERT_TRUE(mcap.ok()) << mcap.status();
    Content a = ContentOf(**sqlite);
    Content b = ContentOf(**mcap);
    // Messages of one instant may be stored in any order.
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    EXPECT_EQ(a, b) << name;
  }
}

// As they would be read while they are written, in steps that end anywhere.
TEST_F(RealBags, GrowingFilesOfOtherWritersHoldTheSame) {
  int file_count = 0;
  for (const char* const folder : {"mcap-conformance", "bags-ros2", "bags"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(Path(folder))) {
      if (entry.path().extension() != ".mcap") continue;
      SCOPED_TRACE(entry.path());
      ++file_count;
      const auto whole = McapFile::Open(entry.path().string());
      const auto growing = McapFile::OpenGrowing(entry.path().string());
      ASSERT_TRUE(whole.ok() && growing.ok()) << whole.status() << growing.status();
      const uint64_t size = std::filesystem::file_size(entry.path());
      const uint64_t step = std::max<uint64_t>(1, size / 50);
      for (uint64_t at = 0; at < size + step; at += step) {
        const absl::Status grown = (*growing)->GrowTo(std::min(at, size));
        ASSERT_TRUE(grown.ok()) << grown;
      }
      EXPECT_TRUE((*growing)->is_closed());
      Content a = ContentOf(**whole);
      Content b = ContentOf(**growing);
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      EXPECT_EQ(a, b);
    }
  }
  EXPECT_GE(file_count, 174 + 10);
}

TEST_F(RealBags, CdrOfOtherWritersIsRead) {
  const auto bag = OpenBagFiles(Path("bags-ros2/sensor_msgs_31types.mcap"));
  ASSERT_TRUE(bag.ok()) << bag.status();
  std::map<std::string, int> read;
  for (const BagMessageRef& ref : (*bag)->messages()) {
    const std::string& type = (*bag)->connections()[ref.connection].type;
    const BagMessage message = *(*bag)->Read(ref);
    absl::Status status = absl::OkStatus();
    if (type == "sensor_msgs/Image") {
      const auto image = ParseRosImage(message.data, type);
      status = image.status();
      if (image.ok()) {
        EXPECT_EQ(image->data.size(), size_t{image->step} * image->height);
      }
    } else if (type == "sensor_msgs/CompressedImage") {
      status = ParseRosCompressedImage(message.data, type).status();
    } else if (type == "sensor_msgs/CameraInfo") {
      const auto info = ParseRosCameraInfo(message.data, type);
      status = info.status();
    } else if (type == "sensor_msgs/Imu") {
      status = ParseRosImu(message.data, type).status();
    } else {
      continue;
    }
    EXPECT_TRUE(status.ok()) << type << status;
    ++read[type];
  }
  EXPECT_EQ(read.size(), 4u);
}

// Its poses are made up (the quaternion is 5 6 7 8 in each), its inertial samples are not.
TEST_F(RealBags, Ros2ImuMakesALogWithPosesFromElsewhere) {
  const std::string path = Path("bags-ros2/pose_imu_battery_a");
  const auto own = OpenLog(path, {});
  ExpectMalformedFile(own.status(), {"/pose message 1", "norm is 13.19", "--pose-file"});
  const auto bag = OpenBagFiles(path);
  ASSERT_TRUE(bag.ok()) << bag.status();
  const TempFolder folder;
  LogOptions options;
  options.pose_file = folder.Write(
      "poses.txt",
      absl::StrCat((*bag)->messages()[500].bag_time_ns / kNsPerSecond, " 1 2 3 0 0 0 1\n"));
  const auto log = ReadAll(path, options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->imu.size(), 357u);
  EXPECT_EQ(log->poses.size(), 1u);
}

TEST_F(RealBags, TurtlebotOdometryMakesALog) {
  const auto log = ReadAll(Path("bags/nav2_turtlebot.mcap"));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "mcap");
  EXPECT_EQ(log->poses.size(), 2639u);
  // And as one that is still written.
  LogOptions options;
  options.follow = FollowOptions{.timeout = std::chrono::milliseconds(0), .stop = nullptr};
  const auto followed = ReadAll(Path("bags/nav2_turtlebot.mcap"), options);
  ASSERT_TRUE(followed.ok()) << followed.status();
  ASSERT_EQ(followed->poses.size(), log->poses.size());
  for (size_t i = 0; i < log->poses.size(); ++i) {
    EXPECT_EQ(followed->poses[i].pose.time_ns, log->poses[i].pose.time_ns);
    EXPECT_EQ(followed->poses[i].pose.map_T_agent.position,
              log->poses[i].pose.map_T_agent.position);
  }
}

// Its localisation tells where the odometry is in the map, its wheels where the robot is in that.
TEST_F(RealBags, TurtlebotTransformsMakeALogWhileTheyAreWritten) {
  LogOptions options;
  options.topics["poses"] = kNoTopic;
  const auto log = ReadAll(Path("bags/nav2_turtlebot.mcap"), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_GT(log->poses.size(), 2000u);
  options.follow = FollowOptions{.timeout = std::chrono::milliseconds(0), .stop = nullptr};
  const auto followed = ReadAll(Path("bags/nav2_turtlebot.mcap"), options);
  ASSERT_TRUE(followed.ok()) << followed.status();
  EXPECT_EQ(followed->order, log->order);
  ASSERT_EQ(followed->poses.size(), log->poses.size());
  for (size_t i = 0; i < log->poses.size(); ++i) {
    EXPECT_EQ(followed->poses[i].pose.map_T_agent.position,
              log->poses[i].pose.map_T_agent.position);
  }
}

TEST_F(RealBags, ImagesOfRos2Decode) {
  const auto log = ReadAll(Path("bags-ros2/soccer_goal_12_two_images.mcap"));
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->images.size(), 2u);
  for (const ImageMeasurement& image : log->images) {
    EXPECT_TRUE(image.load().ok()) << image.load().status();
  }
}

TEST_F(RealBags, TransformsAreTheSameInRos1AndRos2) {
  const auto ros1 = OpenBagFiles(Path("bags/tf_example.bag"));
  const auto ros2 = OpenBagFiles(Path("bags-ros2/tf_example"));
  ASSERT_TRUE(ros1.ok() && ros2.ok());
  const auto transforms = [](const Bag& bag) {
    std::vector<std::tuple<TimeNs, std::string, std::string, double, double>> all;
    for (const BagMessageRef& ref : bag.messages()) {
      if (bag.connections()[ref.connection].topic != "/tf") continue;
      const auto poses = ParseRosTransforms(bag.Read(ref)->data, "tf");
      EXPECT_TRUE(poses.ok()) << poses.status();
      if (!poses.ok()) return all;
      for (const RosPose& pose : *poses) {
        all.emplace_back(pose.header.stamp_ns, pose.header.frame_id, pose.child_frame_id,
                         pose.position.x(), pose.xyzw[3]);
      }
    }
    return all;
  };
  const auto of_ros1 = transforms(**ros1);
  EXPECT_GE(of_ros1.size(), 517u);
  EXPECT_EQ(of_ros1, transforms(**ros2));
}

// The suite lists the records of a file in order; of messages, and of the channels and schemas that
// they belong to, ours must be the same.
TEST_F(RealBags, ConformsToTheSuiteOfMcap) {
  int file_count = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(Path("mcap-conformance"))) {
    if (entry.path().extension() != ".mcap") continue;
    ++file_count;
    std::ifstream in(std::filesystem::path(entry.path()).replace_extension(".json"));
    const nlohmann::json expected = nlohmann::json::parse(in);
    const auto bag = McapFile::Open(entry.path().string());
    ASSERT_TRUE(bag.ok()) << bag.status();
    size_t message_count = 0;
    for (const nlohmann::json& record : expected["records"]) {
      if (record["type"] != "Message") continue;
      ASSERT_LT(message_count, (*bag)->messages().size()) << entry.path();
      const BagMessageRef& ref = (*bag)->messages()[message_count++];
      const auto message = (*bag)->Read(ref);
      ASSERT_TRUE(message.ok()) << message.status();
      std::map<std::string, nlohmann::json> fields;
      for (const nlohmann::json& field : record["fields"]) {
        fields[field[0].get<std::string>()] = field[1];
      }
      std::string data;
      for (const nlohmann::json& byte : fields["data"]) {
        data += static_cast<char>(std::stoi(byte.get<std::string>()));
      }
      EXPECT_EQ(message->data.bytes, data) << entry.path();
      EXPECT_EQ(absl::StrCat(ref.bag_time_ns), fields["log_time"].get<std::string>());
      const BagConnection& connection = (*bag)->connections()[ref.connection];
      EXPECT_EQ(absl::StrCat(connection.id), fields["channel_id"].get<std::string>());
      EXPECT_EQ(connection.topic, "example");
      EXPECT_EQ(connection.type, "Example [a]") << "encoding " << connection.type;
    }
    EXPECT_EQ((*bag)->messages().size(), message_count) << entry.path();
    // Cut anywhere, each is an error.
    std::ifstream bytes_in(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(bytes_in), {}};
    const TempFolder folder;
    for (size_t size = 0; size < bytes.size(); size += 1 + size % 7) {
      EXPECT_EQ(ReasonOf(McapFile::Open(folder.Write("cut.mcap", bytes.substr(0, size))).status()),
                Reason::kFileMalformed)
          << entry.path() << " cut at " << size;
    }
  }
  EXPECT_EQ(file_count, 174);
}

}  // namespace
}  // namespace dsg::ingest
