// SPDX-License-Identifier: Apache-2.0
// A folder and its bag, both through the readers: the same log.
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/log_source.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "schema/base/status.h"
#include "schema/codec/topology.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/simulator/bag/small_log.h"

namespace dsg::simulator {
namespace {

constexpr int kRows = 12;
constexpr int kColumns = 16;
constexpr int kFrameCount = 6;
constexpr TimeNs kBeginNs = 1'700'000'000'000'000'123;
constexpr TimeNs kFrameNs = 50'000'003;

constexpr char kCameraYaml[] =
    "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [0.0, 0.0, 1.0, 0.03,\n -1.0, 0.0, 0.0, $,\n 0.0, -1.0, 0.0, 0.01,\n"
    "  0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [16, 12]\ncamera_model: pinhole\n"
    "intrinsics: [14.5, 14.25, 7.9, 6.1]\ndistortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.2, 0.05, 0.001, -0.002]\n";
constexpr char kImuYaml[] =
    "sensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [1.0, 0.0, 0.0, 0.0,\n 0.0, 1.0, 0.0, 0.0,\n 0.0, 0.0, 1.0, 0.0,\n"
    "  0.0, 0.0, 0.0, 1.0]\nrate_hz: 200\n"
    "gyroscope_noise_density: 1.7e-04\ngyroscope_random_walk: 1.9e-05\n"
    "accelerometer_noise_density: 2.0e-03\naccelerometer_random_walk: 3.0e-03\n";

void WriteCamera(const std::string& folder, const std::string& y_m, int type,
                 const std::string& ending) {
  std::filesystem::create_directories(folder + "/data");
  std::string yaml = kCameraYaml;
  yaml.replace(yaml.find('$'), 1, y_m);
  test::WriteText(folder + "/sensor.yaml", yaml);
  std::string table = "#timestamp [ns],filename\n";
  for (int frame = 0; frame < kFrameCount; ++frame) {
    const std::string name = absl::StrCat(kBeginNs + frame * kFrameNs, ending);
    cv::Mat image(kRows, kColumns, type);
    // Classes 0 to 2 in the upper byte, where they are labels.
    for (int i = 0; i < kRows * kColumns; ++i) {
      if (type == CV_16UC1) image.at<uint16_t>(i) = static_cast<uint16_t>(i * (frame + 1) % 768);
      if (type == CV_8UC1) image.at<uint8_t>(i) = static_cast<uint8_t>(i * (frame + 1));
      if (type == CV_8UC3) image.at<cv::Vec3b>(i) = cv::Vec3b(200, static_cast<uint8_t>(i), 30);
    }
    ASSERT_TRUE(cv::imwrite(absl::StrCat(folder, "/data/", name), image));
    absl::StrAppend(&table, kBeginNs + frame * kFrameNs, ",", name, "\n");
  }
  test::WriteText(folder + "/data.csv", table);
}

std::string Detection(TimeNs time_ns, int id) {
  std::vector<std::string> joints(24, absl::StrCat("[0.1,0.", id, ",0.3]"));
  std::vector<std::string> joints_px(24, "[3.5,4.5,1]");
  return absl::StrCat("{\"time_ns\":", time_ns, ",\"camera\":\"cam0\",\"id\":", id,
                      ",\"score\":0.9,\"box\":[1,2,9,10.5],\"mask_instance\":1,\"joints\":[",
                      absl::StrJoin(joints, ","), "],\"joints_px\":[",
                      absl::StrJoin(joints_px, ","),
                      "],\"weak_camera\":{\"scale\":0.8,\"t\":[0.1,0.2],"
                      "\"crop_center\":[5,6],\"crop_px\":9}}\n");
}

void WriteTables(const std::string& root) {
  for (const char* folder : {"imu0", "state_groundtruth_estimate0", "detections0"}) {
    std::filesystem::create_directories(absl::StrCat(root, "/", folder));
  }
  std::string imu = "#timestamp,wx,wy,wz,ax,ay,az\n";
  std::string poses = "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n";
  std::string detections;
  for (int i = 0; i < 10 * kFrameCount; ++i) {
    const TimeNs time_ns = kBeginNs + i * (kFrameNs / 10);
    absl::StrAppend(&imu, time_ns, ",0.01,-0.0", i, ",0.3,0.1,9.8", i, ",-0.5\n");
    absl::StrAppend(&poses, time_ns, ",1.", i, ",-2.5,0.75,0.8,0,0.6,0\n");
  }
  for (int i = 0; i < kFrameCount; ++i) {
    absl::StrAppend(&detections, Detection(kBeginNs + i * kFrameNs, i));
  }
  test::WriteText(root + "/imu0/data.csv", imu);
  test::WriteText(root + "/imu0/sensor.yaml", kImuYaml);
  test::WriteText(root + "/state_groundtruth_estimate0/data.csv", poses);
  test::WriteText(root + "/detections0/data.jsonl", detections);
  test::WriteText(root + "/detections0/topology.json",
                  "{\"vertex_count\":4,\"faces\":[[0,1,2],[1,2,3]]}");
}

void WriteLog(const std::string& folder) {
  const std::string root = folder + "/mav0";
  WriteCamera(root + "/cam0", "0.05", CV_8UC1, ".png");
  WriteCamera(root + "/cam1", "-0.05", CV_8UC1, ".png");
  WriteCamera(root + "/color0", "0.05", CV_8UC3, ".jpg");
  WriteCamera(root + "/depth0", "0.05", CV_16UC1, ".png");
  WriteCamera(root + "/label0", "0.05", CV_16UC1, ".png");
  WriteTables(root);
  test::WriteText(folder + "/labels.csv", test::kLabels);
}

void ExpectSame(const ingest::ImuMeasurement& a, const ingest::ImuMeasurement& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.angular_velocity_rad_s, b.angular_velocity_rad_s);
  EXPECT_EQ(a.acceleration_m_s2, b.acceleration_m_s2);
}

void ExpectSame(const ingest::PoseMeasurement& a, const ingest::PoseMeasurement& b) {
  EXPECT_EQ(a.agent_name, b.agent_name);
  EXPECT_EQ(a.pose.time_ns, b.pose.time_ns);
  EXPECT_EQ(a.pose.map_T_agent.position, b.pose.map_T_agent.position);
  EXPECT_LT(AngleBetween(a.pose.map_T_agent.orientation, b.pose.map_T_agent.orientation), 1e-9);
}

void ExpectSame(const ingest::HumanDetection& a, const ingest::HumanDetection& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.joints_root, b.joints_root);
}

void ExpectSame(const ingest::ImageMeasurement& a, const ingest::ImageMeasurement& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  ASSERT_EQ(a.channel, b.channel);
  const auto image = a.load();
  const auto again = b.load();
  ASSERT_TRUE(image.ok() && again.ok()) << image.status() << again.status();
  if (a.channel != "depth0") {
    EXPECT_TRUE(image->bytes == again->bytes) << a.channel;
    return;
  }
  for (int i = 0; i < kRows * kColumns; ++i) {
    EXPECT_EQ(ingest::DepthAt(*image, i % kColumns, i / kColumns),
              ingest::DepthAt(*again, i % kColumns, i / kColumns));
  }
}

void ExpectSame(const ingest::LoopMeasurement& a, const ingest::LoopMeasurement& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.from_ns, b.from_ns);
  EXPECT_EQ(a.from_T_to.position, b.from_T_to.position);
  EXPECT_TRUE(a.information.isApprox(b.information, 1e-12));
}

void ExpectSame(const ingest::GraphMeasurement&, const ingest::GraphMeasurement&) {
  ADD_FAILURE() << "a graph in a log of sensors";
}

std::unique_ptr<ingest::LogSource> Open(const std::string& path) {
  auto log = ingest::OpenLog(path, {.poses = ingest::PoseSource::kGroundTruth});
  EXPECT_TRUE(log.ok()) << log.status();
  return log.ok() ? *std::move(log) : nullptr;
}

TEST(BagRoundTrip, ReadsBackAsTheFolderDoes) {
  const dsg::test::TempFolder folder;
  WriteLog(folder.path());
  const std::string path = folder.path() + "/log.bag";
  const absl::Status status = WriteBag(folder.path(), path, nullptr);
  ASSERT_TRUE(status.ok()) << status;
  const auto log = Open(folder.path());
  const auto bag = Open(path);
  ASSERT_TRUE(log != nullptr && bag != nullptr);
  EXPECT_EQ(log->info().channel_counts, bag->info().channel_counts);
  EXPECT_EQ(log->info().measurement_count, 5 * kFrameCount + 21 * kFrameCount);
  for (int64_t i = 0; i < log->info().measurement_count; ++i) {
    const auto a = log->Next();
    const auto b = bag->Next();
    ASSERT_TRUE(a.ok() && b.ok()) << a.status() << b.status();
    ASSERT_TRUE(a->has_value() && b->has_value());
    ASSERT_EQ((*a)->index(), (*b)->index());
    std::visit([&](const auto& m) { ExpectSame(m, std::get<std::decay_t<decltype(m)>>(**b)); },
               **a);
  }
  EXPECT_FALSE((*bag->Next()).has_value());
  ASSERT_TRUE(log->info().body_topology != nullptr && bag->info().body_topology != nullptr);
  EXPECT_EQ(*log->info().body_topology, *bag->info().body_topology);
}

TEST(BagRoundTrip, RefusesBodiesThatTheFacesDoNotFitIfStrict) {
  const dsg::test::TempFolder folder;
  WriteLog(folder.path());
  std::string line = Detection(kBeginNs, 1);
  line.insert(line.find("\"joints\""), "\"vertices\":[0.5,1,2],");
  test::WriteText(folder.path() + "/mav0/detections0/data.jsonl", line);
  const std::string path = folder.path() + "/log.bag";
  ASSERT_TRUE(WriteBag(folder.path(), path, nullptr).ok());
  for (const bool is_strict : {false, true}) {
    auto log =
        ingest::OpenLog(path, {.is_strict = is_strict, .poses = ingest::PoseSource::kGroundTruth});
    absl::Status status = log.status();
    while (status.ok()) {
      const auto next = (*log)->Next();
      status = next.status();
      if (status.ok() && !next->has_value()) break;
    }
    EXPECT_EQ(status.ok(), !is_strict) << status;
    if (is_strict) {
      EXPECT_NE(std::string(status.message()).find("1 vertices"), std::string::npos) << status;
      EXPECT_NE(std::string(status.message()).find("/dsg/detections"), std::string::npos) << status;
    }
  }
}

TEST(BagRoundTrip, KeepsTheCalibrationOfTheCameras) {
  const dsg::test::TempFolder folder;
  WriteLog(folder.path());
  const std::string path = folder.path() + "/log.bag";
  ASSERT_TRUE(WriteBag(folder.path(), path, nullptr).ok());
  const auto log = Open(folder.path());
  const auto bag = Open(path);
  ASSERT_TRUE(log != nullptr && bag != nullptr);
  for (const ingest::CameraCalibration& camera : log->info().rig.cameras) {
    const ingest::CameraCalibration* again = bag->info().rig.FindCamera(camera.name);
    ASSERT_NE(again, nullptr) << camera.name;
    EXPECT_EQ(camera.fx, again->fx);
    EXPECT_EQ(camera.width, again->width);
    EXPECT_EQ(camera.body_T_camera.position, again->body_T_camera.position);
    const Eigen::Vector3d point(0.2, -0.3, 1.5);
    EXPECT_LT((Project(camera, point) - Project(*again, point)).norm(), 1e-9) << camera.name;
  }
}

TEST(BagRoundTrip, RefusesAFolderThatIsNoLog) {
  const dsg::test::TempFolder folder;
  const std::string path = folder.path() + "/log.bag";
  EXPECT_FALSE(WriteBag(folder.path(), path, nullptr).ok());
  EXPECT_TRUE(absl::IsNotFound(WriteBag(folder.path() + "/nowhere", path, nullptr)));
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace dsg::simulator
