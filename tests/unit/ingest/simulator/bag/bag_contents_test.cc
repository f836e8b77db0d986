// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "ingest/simulator/bag/ros_messages.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/simulator/bag/small_log.h"

namespace dsg::simulator {
namespace {

constexpr BagCompression kCompressions[] = {BagCompression::kNone, BagCompression::kBz2,
                                            BagCompression::kLz4};

// A bag as librosbag-storage reads it, topic by topic.
class ReadBag {
 public:
  explicit ReadBag(const std::string& path) : bag_(path), view_(bag_) {
    for (const rosbag::MessageInstance& message : view_) {
      topics_[message.getTopic()].push_back(message);
    }
  }

  size_t Count(const std::string& topic) { return topics_[topic].size(); }
  const std::map<std::string, std::vector<rosbag::MessageInstance>>& topics() { return topics_; }

  // The message of this number, with its bag time.
  template <class Message>
  Message At(const std::string& topic, size_t index, TimeNs time_ns) {
    const auto& messages = topics_[topic];
    EXPECT_LT(index, messages.size()) << topic;
    if (index >= messages.size()) return {};
    EXPECT_EQ(messages[index].getTime().toNSec(), static_cast<uint64_t>(time_ns)) << topic;
    const auto message = messages[index].template instantiate<Message>();
    EXPECT_NE(message, nullptr) << topic << " is of type " << messages[index].getDataType();
    return message == nullptr ? Message() : *message;
  }

  // The next message that was not yet taken, its header checked.
  template <class Message>
  Message Take(const std::string& topic, TimeNs time_ns, const std::string& frame) {
    const size_t index = taken_[topic]++;
    Message message = At<Message>(topic, index, time_ns);
    EXPECT_EQ(message.header.seq, index) << topic;
    EXPECT_EQ(message.header.stamp.toNSec(), static_cast<uint64_t>(time_ns)) << topic;
    EXPECT_EQ(message.header.frame_id, frame) << topic;
    return message;
  }

  void ExpectAllTaken() {
    for (const auto& [topic, messages] : topics_) {
      if (topic.starts_with("/tesse") || topic == "/dsg/label/image_raw") {
        EXPECT_EQ(taken_[topic], messages.size()) << topic;
      }
    }
  }

 private:
  rosbag::Bag bag_;
  rosbag::View view_;
  std::map<std::string, std::vector<rosbag::MessageInstance>> topics_;
  std::map<std::string, size_t> taken_;
};

template <class Vector>
Eigen::Vector3d ToEigen(const Vector& v) {
  return {v.x, v.y, v.z};
}

void ExpectTransform(const ros_messages::TransformStamped& transform, const Pose3d& pose) {
  EXPECT_EQ(ToEigen(transform.transform.translation), pose.position);
  const auto& q = transform.transform.rotation;
  EXPECT_EQ(Eigen::Quaterniond(q.w, q.x, q.y, q.z).coeffs(), pose.orientation.coeffs());
}

// The bytes that docs/sensor_logs.md asks for.
std::vector<uint8_t> ExpectedBytes(const ingest::Image& image) {
  if (image.format != ingest::PixelFormat::kDepth16) return image.bytes;
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i + 1 < image.bytes.size(); i += 2) {
    const float depth_m = static_cast<float>(image.bytes[i] + 256 * image.bytes[i + 1]) / 1000.0F;
    const auto* at = reinterpret_cast<const uint8_t*>(&depth_m);
    bytes.insert(bytes.end(), at, at + 4);
  }
  return bytes;
}

void ExpectImage(const ros_messages::Image& message, const ingest::Image& image,
                 const std::string& encoding) {
  EXPECT_EQ(message.encoding, encoding);
  EXPECT_EQ(message.width, static_cast<uint32_t>(image.width));
  EXPECT_EQ(message.height, static_cast<uint32_t>(image.height));
  EXPECT_EQ(message.is_bigendian, 0);
  const std::vector<uint8_t> bytes(message.data.begin(), message.data.end());
  EXPECT_EQ(size_t{message.step} * message.height, bytes.size());
  const std::vector<uint8_t> expected = ExpectedBytes(image);
  if (encoding != "32FC1") {
    EXPECT_EQ(bytes, expected);
    return;
  }
  ASSERT_EQ(bytes.size(), expected.size());
  for (size_t i = 0; i < bytes.size(); i += 4) {
    float is = 0.0F;
    float wanted = 0.0F;
    std::memcpy(&is, &bytes[i], 4);
    std::memcpy(&wanted, &expected[i], 4);
    EXPECT_FLOAT_EQ(is, wanted);
  }
}

void ExpectColors(const ros_messages::Image& message, const ingest::Image& labels) {
  const uint8_t colors[3][3] = {{0, 0, 0}, {250, 10, 20}, {30, 0, 255}};
  EXPECT_EQ(message.encoding, "rgb8");
  ASSERT_EQ(message.data.size(), labels.bytes.size() / 2 * 3);
  for (size_t i = 0; i < labels.bytes.size() / 2; ++i) {
    EXPECT_EQ(std::memcmp(&message.data[3 * i], colors[labels.bytes[2 * i + 1]], 3), 0);
  }
}

void ExpectImageMeasurement(const ingest::ImageMeasurement& measurement, ReadBag* bag) {
  struct Expected {
    std::string topic;
    std::string encoding;
    std::string frame;
  };
  const std::map<std::string, Expected> by_channel = {
      {"cam0", {"/tesse/left_cam/mono/image_raw", "mono8", "left_cam"}},
      {"cam1", {"/tesse/right_cam/mono/image_raw", "mono8", "right_cam"}},
      {"color0", {"/tesse/left_cam/rgb/image_raw", "rgb8", "left_cam"}},
      {"depth0", {"/tesse/depth_cam/mono/image_raw", "32FC1", "left_cam"}},
      {"label0", {"/dsg/label/image_raw", "mono16", "left_cam"}}};
  const ingest::Image image = *measurement.load();
  const Expected& expected = by_channel.at(measurement.channel);
  ExpectImage(bag->Take<ros_messages::Image>(expected.topic, measurement.time_ns, expected.frame),
              image, expected.encoding);
  if (measurement.channel == "label0") {
    ExpectColors(bag->Take<ros_messages::Image>("/tesse/seg_cam/rgb/image_raw", measurement.time_ns,
                                                "left_cam"),
                 image);
  }
  if (measurement.channel.starts_with("cam")) {
    const std::string topic = absl::StrCat(
        "/tesse/", measurement.channel == "cam0" ? "left" : "right", "_cam/camera_info");
    bag->Take<ros_messages::CameraInfo>(topic, measurement.time_ns, expected.frame);
  }
}

void ExpectMeasurement(const ingest::ImuMeasurement& imu, ReadBag* bag) {
  const auto message =
      bag->Take<ros_messages::Imu>("/tesse/imu/noisy/imu", imu.time_ns, "base_link_gt");
  EXPECT_EQ(ToEigen(message.angular_velocity), imu.angular_velocity_rad_s);
  EXPECT_EQ(ToEigen(message.linear_acceleration), imu.acceleration_m_s2);
  EXPECT_EQ(message.orientation_covariance[0], -1.0);
}

void ExpectMeasurement(const ingest::PoseMeasurement& pose, ReadBag* bag) {
  const auto message = bag->Take<ros_messages::Odometry>("/tesse/odom", pose.pose.time_ns, "world");
  EXPECT_EQ(message.child_frame_id, "base_link_gt");
  EXPECT_EQ(ToEigen(message.pose.pose.position), pose.pose.map_T_agent.position);
  const auto& q = message.pose.pose.orientation;
  EXPECT_EQ(Eigen::Quaterniond(q.w, q.x, q.y, q.z).coeffs(),
            pose.pose.map_T_agent.orientation.coeffs());
}

class BagContents : public testing::Test {
 protected:
  void SetUp() override { test::WriteFolder(log_, folder_.path()); }

  std::string Write(const std::string& name, BagCompression compression = BagCompression::kLz4) {
    std::string path = folder_.path() + "/" + name;
    log_.Rewind();
    const absl::Status status =
        WriteBag(&log_, folder_.path(), path, BagOptions{.compression = compression});
    EXPECT_TRUE(status.ok()) << status;
    return path;
  }

  dsg::test::TempFolder folder_;
  test::SmallLog log_ = test::MakeSmallLog(dsg::test::TestSeed(7));
};

TEST_F(BagContents, HoldsEveryMeasurementInEveryCompression) {
  for (const BagCompression compression : kCompressions) {
    ReadBag bag(Write("a.bag", compression));
    for (const ingest::Measurement& measurement : log_.measurements) {
      if (const auto* image = std::get_if<ingest::ImageMeasurement>(&measurement)) {
        ExpectImageMeasurement(*image, &bag);
      } else if (const auto* imu = std::get_if<ingest::ImuMeasurement>(&measurement)) {
        ExpectMeasurement(*imu, &bag);
      } else if (const auto* pose = std::get_if<ingest::PoseMeasurement>(&measurement)) {
        ExpectMeasurement(*pose, &bag);
      }
    }
    bag.ExpectAllTaken();
    EXPECT_EQ(bag.topics().size(), 13U);
  }
}

TEST_F(BagContents, HoldsTheCalibrationOfBothCameras) {
  ReadBag bag(Write("a.bag"));
  const ingest::CameraCalibration& camera = log_.log_info.rig.cameras[1];
  const auto left = bag.Take<ros_messages::CameraInfo>("/tesse/left_cam/camera_info",
                                                       log_.log_info.first_ns, "left_cam");
  const auto right = bag.Take<ros_messages::CameraInfo>("/tesse/right_cam/camera_info",
                                                        log_.log_info.first_ns, "right_cam");
  EXPECT_EQ(right.width, static_cast<uint32_t>(camera.width));
  EXPECT_EQ(right.height, static_cast<uint32_t>(camera.height));
  EXPECT_EQ(right.distortion_model, "plumb_bob");
  const std::vector<double> coefficients(right.D.begin(), right.D.end());
  EXPECT_EQ(coefficients, (std::vector<double>{-0.28, 0.07, 0.0002, 0.00002, 0.0}));
  const double k[9] = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  EXPECT_TRUE(std::equal(right.K.begin(), right.K.end(), k));
  EXPECT_EQ(left.P[3], 0.0);
  EXPECT_NEAR(right.P[3], -camera.fx * 0.11, 1e-12);
  EXPECT_EQ(right.P[0], camera.fx);
  EXPECT_EQ(right.P[6], camera.cy);
}

TEST_F(BagContents, BeginsWithLabelsAndTransformsForLateListeners) {
  ReadBag bag(Write("a.bag"));
  ASSERT_EQ(bag.Count("/dsg/labels"), 1U);
  EXPECT_EQ(bag.At<ros_messages::String>("/dsg/labels", 0, log_.log_info.first_ns).data,
            test::kLabels);
  ASSERT_EQ(bag.Count("/tf_static"), 1U);
  const auto tf = bag.At<ros_messages::TfMessage>("/tf_static", 0, log_.log_info.first_ns);
  ASSERT_EQ(tf.transforms.size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(tf.transforms[i].header.frame_id, "base_link_gt");
    EXPECT_EQ(tf.transforms[i].child_frame_id, i == 0 ? "left_cam" : "right_cam");
    ExpectTransform(tf.transforms[i], log_.log_info.rig.cameras[i].body_T_camera);
  }
  EXPECT_EQ(bag.topics().at("/tf_static")[0].isLatching(), true);
}

TEST_F(BagContents, KeepsTheLinesOfDetectionsAsTheyStand) {
  ReadBag bag(Write("a.bag"));
  const std::vector<std::string> lines = test::DetectionLinesOf(log_);
  ASSERT_EQ(bag.Count("/dsg/detections"), lines.size());
  for (size_t i = 0; i < lines.size(); ++i) {
    const auto& message = bag.topics().at("/dsg/detections")[i];
    EXPECT_EQ(message.instantiate<ros_messages::String>()->data, lines[i]);
    const std::string stamp = absl::StrCat(message.getTime().toNSec());
    EXPECT_NE(lines[i].find(stamp), std::string::npos) << lines[i];
  }
}

TEST_F(BagContents, LiesInTheOrderOfStampsInTheFile) {
  const std::string bytes = test::ReadBytes(Write("a.bag", BagCompression::kNone));
  size_t last = 0;
  for (const std::string& line : test::DetectionLinesOf(log_)) {
    const size_t at = bytes.find(line);
    ASSERT_NE(at, std::string::npos);
    EXPECT_GT(at, last);
    last = at;
  }
  size_t image_at = 0;
  for (const ingest::Measurement& measurement : log_.measurements) {
    const auto* image = std::get_if<ingest::ImageMeasurement>(&measurement);
    if (image == nullptr || image->channel != "cam1") continue;
    const ingest::Image loaded = *image->load();
    const size_t at = bytes.find(std::string(loaded.bytes.begin(), loaded.bytes.end()));
    ASSERT_NE(at, std::string::npos);
    EXPECT_GT(at, image_at);
    image_at = at;
  }
  // The last line is seconds after the last image, the first at the stamp of the first.
  EXPECT_GT(last, image_at);
  EXPECT_LT(bytes.find(test::DetectionLinesOf(log_)[0]), image_at);
}

TEST_F(BagContents, HasTheSameBytesEachTime) {
  for (const BagCompression compression : kCompressions) {
    const std::string once = test::ReadBytes(Write("a.bag", compression));
    const std::string again = test::ReadBytes(Write("b.bag", compression));
    EXPECT_GT(once.size(), 1000U);
    EXPECT_TRUE(once == again) << static_cast<int>(compression);
  }
}

TEST_F(BagContents, TellsProgressUpwardsToTheEnd) {
  std::vector<double> told;
  const BagOptions options{.progress = [&](double fraction) { told.push_back(fraction); }};
  ASSERT_TRUE(WriteBag(&log_, folder_.path(), folder_.path() + "/a.bag", options).ok());
  ASSERT_GT(told.size(), 10U);
  EXPECT_EQ(told.front(), 0.0);
  EXPECT_EQ(told.back(), 1.0);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
}

TEST_F(BagContents, NeedsNeitherLabelsNorDetections) {
  log_.log_info.channel_counts.clear();
  std::erase_if(log_.measurements, [](const ingest::Measurement& m) {
    const auto* image = std::get_if<ingest::ImageMeasurement>(&m);
    return image != nullptr && image->channel == "label0";
  });
  const dsg::test::TempFolder empty;
  const std::string path = empty.path() + "/a.bag";
  ASSERT_TRUE(WriteBag(&log_, empty.path(), path, BagOptions{}).ok());
  ReadBag bag(path);
  EXPECT_EQ(bag.Count("/dsg/labels"), 0U);
  EXPECT_EQ(bag.Count("/dsg/detections"), 0U);
  EXPECT_EQ(bag.Count("/tesse/odom"), 20U);
}

}  // namespace
}  // namespace dsg::simulator
