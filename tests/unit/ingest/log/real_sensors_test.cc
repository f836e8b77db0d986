// SPDX-License-Identifier: Apache-2.0
// The readers of sensor logs against recorded ones; counts are those of the data's README files.
#include <map>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

struct RealSensorLog {
  const char* path;
  const char* format;
  std::map<std::string, int64_t> counts;
  int width;
  int height;
  /// Cameras with a calibration.
  size_t camera_count;
};

void PrintTo(const RealSensorLog& log, std::ostream* out) { *out << log.path; }

class RealSensorLogTest : public testing::TestWithParam<RealSensorLog> {
 protected:
  void SetUp() override {
    if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
};

// Channels rise in rank at equal stamps: imu, poses, images by name, detections.
int RankOf(const std::string& channel) {
  if (channel == "imu0") return 0;
  if (channel == "poses") return 1;
  return channel == "detections0" ? 3 : 2;
}

PixelFormat PixelFormatOf(const std::string& channel, const std::string& path) {
  if (channel.starts_with("cam")) return PixelFormat::kGray8;
  if (channel.starts_with("color")) return PixelFormat::kRgb8;
  const bool is_float = path.find("replica") != std::string::npos ||
                        path.find("uhumans2") != std::string::npos ||
                        path.find("rgbd-tum") != std::string::npos;
  return is_float ? PixelFormat::kDepth32 : PixelFormat::kDepth16;
}

TEST_P(RealSensorLogTest, HasTheCountsOfItsReadmeAndDecodes) {
  const RealSensorLog& expected = GetParam();
  const auto log = ReadAll((DataFolder() / expected.path).string());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, expected.format);
  EXPECT_EQ(log->info.channel_counts, expected.counts);
  EXPECT_EQ(log->info.rig.cameras.size(), expected.camera_count);
  int64_t total = 0;
  for (const auto& [channel, count] : expected.counts) total += count;
  EXPECT_EQ(log->info.measurement_count, total);
  std::map<std::string, int64_t> found;
  for (size_t i = 0; i < log->order.size(); ++i) {
    const auto& [channel, time_ns] = log->order[i];
    ++found[channel];
    if (i == 0) continue;
    const auto& [last_channel, last_ns] = log->order[i - 1];
    EXPECT_LE(std::tuple(last_ns, RankOf(last_channel), last_channel),
              std::tuple(time_ns, RankOf(channel), channel));
  }
  EXPECT_EQ(found, expected.counts);
  EXPECT_EQ(log->info.first_ns, log->order.front().second);
  for (const ImageMeasurement& measurement : log->images) {
    const absl::StatusOr<Image> image = measurement.load();
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_EQ(image->width, expected.width) << measurement.origin;
    EXPECT_EQ(image->height, expected.height) << measurement.origin;
    EXPECT_EQ(image->format, PixelFormatOf(measurement.channel, expected.path))
        << measurement.origin;
    EXPECT_EQ(image->bytes.size(), image->Offset(0, image->height));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Data, RealSensorLogTest,
    testing::Values(
        RealSensorLog{"euroc-mh01-stereo",
                      "euroc",
                      {{"cam0", 160}, {"cam1", 160}, {"imu0", 1791}, {"poses", 1791}},
                      752,
                      480,
                      2},
        RealSensorLog{"euroc-imu-groundtruth/V1_02_medium",
                      "euroc",
                      {{"imu0", 17100}, {"poses", 16702}},
                      0,
                      0,
                      0},
        RealSensorLog{
            "euroc-loop-pairs", "rgbd", {{"cam0", 4}, {"cam1", 4}, {"poses", 4}}, 752, 480, 2},
        RealSensorLog{"rgbd-7scenes",
                      "rgbd",
                      {{"color0", 125}, {"depth0", 125}, {"poses", 125}},
                      640,
                      480,
                      2},
        RealSensorLog{"rgbd-livingroom1",
                      "rgbd",
                      {{"color0", 106}, {"depth0", 106}, {"poses", 106}},
                      640,
                      480,
                      2},
        RealSensorLog{"rgbd-replica-office0",
                      "rgbd",
                      {{"color0", 2}, {"depth0", 2}, {"poses", 2000}},
                      1200,
                      680,
                      2},
        RealSensorLog{"rgbd-tum/freiburg1_rpy",
                      "tum-rgbd",
                      {{"color0", 18}, {"depth0", 18}, {"poses", 313}},
                      640,
                      480,
                      2},
        RealSensorLog{"rgbd-tum/freiburg3_cabinet",
                      "tum-rgbd",
                      {{"color0", 58}, {"depth0", 58}, {"poses", 58}},
                      640,
                      480,
                      2},
        RealSensorLog{"uhumans2-tesse/rgbd", "rgbd", {{"color0", 2}, {"depth0", 2}}, 720, 480, 2},
        RealSensorLog{"uhumans2-tesse/loop_pair",
                      "rgbd",
                      {{"color0", 2}, {"depth0", 2}, {"poses", 2}},
                      720,
                      480,
                      0},
        RealSensorLog{"bags/euroc_mh01_stereo_4pairs_none.bag",
                      "rosbag",
                      {{"cam0", 4}, {"cam1", 4}, {"imu0", 49}},
                      752,
                      480,
                      0},
        RealSensorLog{"bags/euroc_mh01_stereo_4pairs_bz2.bag",
                      "rosbag",
                      {{"cam0", 4}, {"cam1", 4}, {"imu0", 49}},
                      752,
                      480,
                      0},
        RealSensorLog{"bags/ardrone_imu.bag", "rosbag", {{"imu0", 4308}}, 0, 0, 0},
        RealSensorLog{"bags/single_depth_color_640x480.bag",
                      "rosbag",
                      {{"color0", 1}, {"depth0", 2}},
                      640,
                      480,
                      2}),
    [](const auto& param_info) {
      std::string name = param_info.param.path;
      std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
      return name;
    });

class RealSensorLogs : public testing::Test {
 protected:
  void SetUp() override {
    if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  static std::string Path(const std::string& name) { return (DataFolder() / name).string(); }
};

TEST_F(RealSensorLogs, EurocCalibrationIsItsYaml) {
  const auto log = OpenLog(Path("euroc-mh01-stereo"), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const RigCalibration& rig = (*log)->info().rig;
  const CameraCalibration& left = *rig.FindCamera("cam0");
  const CameraCalibration& right = *rig.FindCamera("cam1");
  EXPECT_EQ(left.fx, 458.654);
  EXPECT_EQ(left.distortion, Distortion::kRadialTangential);
  EXPECT_NEAR((left.body_T_camera.position - right.body_T_camera.position).norm(), 0.1101, 1e-4);
  ASSERT_TRUE(rig.imu.has_value());
  EXPECT_EQ(rig.imu->rate_hz, 200.0);
  EXPECT_EQ(rig.imu->gyro_noise_density, 1.6968e-04);
}

TEST_F(RealSensorLogs, Bz2BagEqualsTheUncompressedOneAndTheFolder) {
  const auto none = ReadAll(Path("bags/euroc_mh01_stereo_4pairs_none.bag"));
  const auto bz2 = ReadAll(Path("bags/euroc_mh01_stereo_4pairs_bz2.bag"));
  const auto folder = ReadAll(Path("euroc-mh01-stereo"));
  ASSERT_TRUE(none.ok() && bz2.ok() && folder.ok());
  EXPECT_EQ(none->order, bz2->order);
  ASSERT_EQ(none->imu.size(), bz2->imu.size());
  for (size_t i = 0; i < none->imu.size(); ++i) {
    EXPECT_EQ(none->imu[i].angular_velocity_rad_s, bz2->imu[i].angular_velocity_rad_s);
    EXPECT_EQ(none->imu[i].acceleration_m_s2, bz2->imu[i].acceleration_m_s2);
  }
  std::map<std::pair<std::string, TimeNs>, const ImageMeasurement*> png;
  for (const ImageMeasurement& image : folder->images) png[{image.channel, image.time_ns}] = &image;
  for (size_t i = 0; i < none->images.size(); ++i) {
    const Image image = *none->images[i].load();
    EXPECT_EQ(image.bytes, bz2->images[i].load()->bytes);
    const auto same = png.find({none->images[i].channel, none->images[i].time_ns});
    ASSERT_NE(same, png.end()) << none->images[i].time_ns;
    EXPECT_EQ(image.bytes, same->second->load()->bytes);
  }
  EXPECT_TRUE(HasNote(none->info, "no calibration for cam0, cam1"));
}

TEST_F(RealSensorLogs, BagsWithoutSensorsOpenAndNameTheirTopics) {
  for (const auto& [path, topic] :
       {std::pair("bags-ros2/talker_sqlite3", "/rosout (10 rcl_interfaces/Log)"),
        std::pair("bags-ros2/base_msgs.mcap", "geometry_msgs/Twist")}) {
    const auto log = OpenLog(Path(path), {});
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ((*log)->info().measurement_count, 0);
    EXPECT_TRUE(HasNote((*log)->info(), topic)) << path;
    ExpectMalformedFile((*log)->Next().status(), {"no topic that can be used", topic});
  }
}

TEST_F(RealSensorLogs, TransformsOfRos1AndRos2AreOneTrajectory) {
  const auto ros1 = ReadAll(Path("bags/tf_example.bag"));
  const auto ros2 = ReadAll(Path("bags-ros2/tf_example"));
  ASSERT_TRUE(ros1.ok()) << ros1.status();
  ASSERT_TRUE(ros2.ok()) << ros2.status();
  EXPECT_EQ(ros1->poses.size(), 517u);
  EXPECT_EQ(ros1->order, ros2->order);
  for (size_t i = 0; i < ros1->poses.size(); ++i) {
    EXPECT_EQ(ros1->poses[i].pose.map_T_agent.position, ros2->poses[i].pose.map_T_agent.position);
  }
  EXPECT_TRUE(HasNote(ros2->info, "frame \"base_link\" in \"odom\""));
}

TEST_F(RealSensorLogs, RealSenseBagHasItsCalibrationAndCountsItsTopics) {
  const auto log = OpenLog(Path("bags/single_depth_color_640x480.bag"), {});
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(HasNote((*log)->info(), "more"));
  const CameraCalibration* depth = (*log)->info().rig.FindCamera("depth0");
  ASSERT_NE(depth, nullptr);
  EXPECT_EQ(depth->width, 640);
  EXPECT_GT(depth->fx, 300.0);
}

TEST_F(RealSensorLogs, SevenScenesKeepsItsFrameNumbersAndMendsItsRotations) {
  LogOptions options;
  options.image_period_ns = 1000;
  const auto log = ReadAll(Path("rgbd-7scenes"), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(log->info.has_clock);
  for (const auto& [channel, time_ns] : log->order) EXPECT_EQ(time_ns % 8000, 0);
  int64_t reading_count = 0;
  float depth_max_m = 0.0f;
  for (const ImageMeasurement& measurement : log->images) {
    if (measurement.channel != "depth0") continue;
    const Image image = *measurement.load();
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const float depth = DepthAt(image, u, v);
        reading_count += depth > 0.0f ? 1 : 0;
        depth_max_m = std::max(depth_max_m, depth);
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(reading_count) / (125.0 * 640 * 480), 0.89, 0.005);
  EXPECT_NEAR(depth_max_m, 3.98f, 0.005f) << "65535 is no reading";
}

TEST_F(RealSensorLogs, ReplicaDepthIsMetresAndThePathIsAsLongAsStated) {
  const auto log = ReadAll(Path("rgbd-replica-office0"));
  ASSERT_TRUE(log.ok()) << log.status();
  double path_m = 0.0;
  for (size_t i = 1; i < log->poses.size(); ++i) {
    path_m +=
        (log->poses[i].pose.map_T_agent.position - log->poses[i - 1].pose.map_T_agent.position)
            .norm();
  }
  EXPECT_NEAR(path_m, 18.2, 0.1);
  for (const ImageMeasurement& image : log->images) {
    if (image.channel != "depth0") continue;
    const float depth = DepthAt(*image.load(), 600, 340);
    EXPECT_GT(depth, 0.5f);
    EXPECT_LT(depth, 6.0f);
  }
}

TEST_F(RealSensorLogs, TumDepthHasTheRangeOfItsReadme) {
  const auto log = ReadAll(Path("rgbd-tum/freiburg1_rpy"));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.rig.FindCamera("depth0")->fx, 517.3);
  const auto first =
      std::find_if(log->images.begin(), log->images.end(),
                   [](const ImageMeasurement& image) { return image.channel == "depth0"; });
  const Image image = *first->load();
  std::vector<float> depths;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (DepthAt(image, u, v) > 0.0f) depths.push_back(DepthAt(image, u, v));
    }
  }
  EXPECT_NEAR(static_cast<double>(depths.size()) / (640.0 * 480.0), 0.80, 0.01);
  EXPECT_NEAR(*std::min_element(depths.begin(), depths.end()), 0.58f, 0.01f);
  EXPECT_NEAR(*std::max_element(depths.begin(), depths.end()), 1.54f, 0.01f);
}

// Stamps, poses, intrinsics and the unit of depth together: a face of the cabinet is where its
// README measured it.
TEST_F(RealSensorLogs, TumDepthLiesOnTheCabinet) {
  const auto log = ReadAll(Path("rgbd-tum/freiburg3_cabinet"));
  ASSERT_TRUE(log.ok()) << log.status();
  const CameraCalibration& camera = *log->info.rig.FindCamera("depth0");
  const auto world_point = [&](size_t frame) {
    char name[64];
    std::snprintf(name, sizeof(name), "rgbd-tum/freiburg3_cabinet/bbox_2d_yolov2/%04zu", frame);
    double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(Path(name)).parent_path())) {
      if (!entry.path().string().starts_with(Path(name))) continue;
      std::ifstream(entry.path()) >> x >> y >> width >> height;
    }
    std::vector<const ImageMeasurement*> depths;
    for (const ImageMeasurement& image : log->images) {
      if (image.channel == "depth0") depths.push_back(&image);
    }
    EXPECT_EQ(depths[frame]->time_ns, log->poses[frame].pose.time_ns);
    const double u = x + width / 2.0;
    const double v = y + height / 2.0;
    const double z = DepthAt(*depths[frame]->load(), static_cast<int>(u), static_cast<int>(v));
    return Eigen::Vector3d(
        log->poses[frame].pose.map_T_agent *
        Eigen::Vector3d((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z));
  };
  EXPECT_NEAR(world_point(10).y(), 0.679, 0.01);
  EXPECT_NEAR(world_point(50).x(), -1.926, 0.02);
}

TEST_F(RealSensorLogs, LoopPairsHaveTheRelativeMotionOfTheirReadme) {
  const auto log = ReadAll(Path("euroc-loop-pairs"));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->info.has_clock);
  ASSERT_EQ(log->poses.size(), 4u);
  // By stamp: the query of the first pair, its match, the query of the second, its match.
  const auto motion = [&](size_t a, size_t b) {
    return log->poses[a].pose.map_T_agent.Inverse() * log->poses[b].pose.map_T_agent;
  };
  EXPECT_NEAR(motion(0, 1).position.norm(), 0.411, 0.001);
  EXPECT_NEAR(motion(2, 3).position.norm(), 0.319, 0.001);
  EXPECT_NEAR(AngleBetween(log->poses[0].pose.map_T_agent.orientation,
                           log->poses[1].pose.map_T_agent.orientation) *
                  180.0 / M_PI,
              37.5, 0.1);
}

TEST_F(RealSensorLogs, TesseObjectsAreAllThere) {
  for (const auto& [path, count] : {std::pair("apartment_static_tfs_ros.csv", 1225u),
                                    std::pair("office_static_tfs_ros.csv", 1794u),
                                    std::pair("neighborhood_static_tfs_ros.csv", 1709u),
                                    std::pair("tesse_multiscene_office2_static_tfs.csv", 3578u)}) {
    const auto log = ReadAll(Path(std::string("uhumans2-tesse/objects/") + path));
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->info.format, "tesse-objects");
    ASSERT_EQ(log->graphs.size(), 1u);
    const std::vector<Node>& nodes = log->graphs[0].delta.nodes;
    EXPECT_EQ(nodes.size(), count);
    int64_t class_count = 0;
    for (const Node& node : nodes) class_count += node.class_id >= 0 ? 1 : 0;
    EXPECT_GT(class_count, static_cast<int64_t>(count / 2)) << path;
  }
  const auto office = ReadAll(Path("uhumans2-tesse/objects/office_static_tfs_ros.csv"));
  ASSERT_TRUE(office.ok());
  bool has_couch = false;
  for (const Node& node : office->graphs[0].delta.nodes) {
    const Eigen::Vector3d& p = node.map_T_node.position;
    has_couch |= node.name.starts_with("Couch_1seat") && std::abs(p.x() - 3.007) < 1e-3 &&
                 std::abs(p.y() - 18.902) < 1e-3 && node.class_id == 7;
  }
  EXPECT_TRUE(has_couch);
}

}  // namespace
}  // namespace dsg::ingest
