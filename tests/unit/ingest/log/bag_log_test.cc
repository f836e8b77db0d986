// SPDX-License-Identifier: Apache-2.0
// Bags as logs: topics, calibration, the order of stamps.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/bag_writer.h"
#include "tests/unit/ingest/log/detection_lines.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

constexpr char kImage[] = "sensor_msgs/Image";

std::string Floats(const std::vector<float>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * 4);
}

// All topics that are known, at two instants.
BagWriter FullBag() {
  BagWriter bag("lz4");
  bag.Add("/dsg/labels", "std_msgs/String", kT0,
          StringMessage("name,red,green,blue,alpha,id\nchair,10,20,30,255,5\nwall,1,2,3,255,19\n"));
  const std::string extrinsics =
      ByteWriter().U32(2).bytes() +
      TransformBytes(kT0, "base_link_gt", "left_cam", {0, 0.05, 0, 0.5, -0.5, 0.5, -0.5}) +
      TransformBytes(kT0, "base_link_gt", "right_cam", {0, -0.05, 0, 0.5, -0.5, 0.5, -0.5});
  bag.Add("/tf_static", "tf2_msgs/TFMessage", kT0, extrinsics);
  for (const std::string side : {"left", "right"}) {
    bag.Add(absl::StrCat("/tesse/", side, "_cam/camera_info"), "sensor_msgs/CameraInfo", kT0,
            CameraInfoMessage(2, 1, 415.7, "plumb_bob", {0.1, 0, 0, 0, 0}, side + "_cam"));
  }
  for (int i = 0; i < 2; ++i) {
    const TimeNs t = kT0 + TimeNs{i} * 50'000'000;
    // Recorded in no order at all.
    bag.Add("/dsg/detections", "std_msgs/String", t, StringMessage(DetectionLine(t, 2 * i)));
    bag.Add("/dsg/detections", "std_msgs/String", t, StringMessage(DetectionLine(t, 2 * i + 1)));
    bag.Add("/tesse/depth_cam/mono/image_raw", kImage, t,
            ImageMessage(t, "32FC1", 2, 1, 8, Floats({1.5f, 2.5f})));
    bag.Add("/tesse/left_cam/mono/image_raw", kImage, t, ImageMessage(t, "mono8", 2, 1, 3, "abc"));
    bag.Add("/tesse/right_cam/mono/image_raw", kImage, t, ImageMessage(t, "mono8", 2, 1, 2, "de"));
    bag.Add("/tesse/left_cam/rgb/image_raw", kImage, t,
            ImageMessage(t, "bgra8", 2, 1, 8, "BGRABGRA"));
    bag.Add("/tesse/seg_cam/rgb/image_raw", kImage, t,
            ImageMessage(t, "rgb8", 2, 1, 6, std::string("\x0a\x14\x1e\x01\x02\x03", 6)));
    bag.Add("/tesse/odom", "nav_msgs/Odometry", t, OdometryMessage(t, {1.0 * i, 2, 3, 0, 0, 0, 1}));
    bag.Add("/tesse/imu/noisy/imu", "sensor_msgs/Imu", t, ImuMessage(t, 0.1, 9.81));
    bag.Add("/tesse/imu/clean/imu", "sensor_msgs/Imu", t, ImuMessage(t, 0.0, 9.81));
  }
  return bag;
}

TEST(BagLog, KnowsTheTopicsOfUHumans2) {
  const TempFolder folder;
  const auto log = ReadAll(folder.Write("log.bag", FullBag().Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "rosbag");
  EXPECT_EQ(log->info.first_ns, kT0);
  EXPECT_EQ(log->info.clock, Clock::kUnix);
  const std::map<std::string, int64_t> counts = {{"cam0", 2},   {"cam1", 2},       {"color0", 2},
                                                 {"depth0", 2}, {"label0", 2},     {"poses", 2},
                                                 {"imu0", 2},   {"detections0", 4}};
  EXPECT_EQ(log->info.channel_counts, counts);
  const std::vector<std::string> order = {"imu0",   "poses",  "cam0",        "cam1",       "color0",
                                          "depth0", "label0", "detections0", "detections0"};
  ASSERT_EQ(log->order.size(), 2 * order.size());
  for (size_t i = 0; i < log->order.size(); ++i) {
    EXPECT_EQ(log->order[i].first, order[i % order.size()]) << i;
  }
  EXPECT_EQ(log->imu[0].angular_velocity_rad_s.x(), 0.1);
  EXPECT_EQ(log->imu[0].acceleration_m_s2.z(), 9.81);
  EXPECT_EQ(log->poses[1].pose.map_T_agent.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(log->detections[3].id, 3);
  EXPECT_TRUE(HasNote(log->info, "/tesse/imu/clean/imu (2 sensor_msgs/Imu)"));
}

TEST(BagLog, ConvertsPixelsAfterTheLogIsClosed) {
  const TempFolder folder;
  const auto log = ReadAll(folder.Write("log.bag", FullBag().Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  std::map<std::string, Image> images;
  for (const ImageMeasurement& measurement : log->images) {
    const auto image = measurement.load();
    ASSERT_TRUE(image.ok()) << image.status();
    images[measurement.channel] = *image;
  }
  EXPECT_EQ(images["cam0"].bytes, (std::vector<uint8_t>{'a', 'b'})) << "rows may be padded";
  EXPECT_EQ(images["color0"].bytes, (std::vector<uint8_t>{'R', 'G', 'B', 'R', 'G', 'B'}));
  EXPECT_EQ(images["color0"].format, PixelFormat::kRgb8);
  EXPECT_EQ(DepthAt(images["depth0"], 1, 0), 2.5f);
  EXPECT_EQ(LabelAt(images["label0"], 0, 0), 5 << 8);
  EXPECT_EQ(LabelAt(images["label0"], 1, 0), 19 << 8);
}

TEST(BagLog, TakesCalibrationFromCameraInfoAndStaticTransforms) {
  const TempFolder folder;
  const auto log = OpenLog(folder.Write("log.bag", FullBag().Finish()), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const RigCalibration& rig = (*log)->info().rig;
  ASSERT_EQ(rig.cameras.size(), 5u);
  const CameraCalibration& right = *rig.FindCamera("cam1");
  EXPECT_EQ(right.fx, 415.7);
  EXPECT_EQ(right.distortion, Distortion::kRadialTangential);
  EXPECT_EQ(right.body_T_camera.position, Eigen::Vector3d(0, -0.05, 0));
  // The optical axis points ahead.
  EXPECT_NEAR((right.body_T_camera.orientation * Eigen::Vector3d::UnitZ()).x(), 1.0, 1e-9);
  EXPECT_EQ(rig.FindCamera("depth0")->body_T_camera.position, Eigen::Vector3d(0, 0.05, 0));
}

TEST(BagLog, SaysWhereTheInertialUnitSitsAndHowOftenItMeasures) {
  const TempFolder folder;
  const auto log = OpenLog(folder.Write("log.bag", FullBag().Finish()), {});
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_TRUE((*log)->info().rig.imu.has_value());
  const ImuCalibration& imu = *(*log)->info().rig.imu;
  EXPECT_EQ(imu.name, "imu0");
  // Two messages, 50 ms apart.
  EXPECT_NEAR(imu.rate_hz, 20.0, 1e-9);
  EXPECT_EQ(imu.body_T_imu.position, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(imu.gyro_noise_density, 0.0);
  EXPECT_TRUE(imu.Validate().ok());
}

TEST(BagLog, PrefersLabelImagesWithInstances) {
  const TempFolder folder;
  BagWriter bag = FullBag();
  bag.Add("/dsg/label/image_raw", kImage, kT0, ImageMessage(kT0, "mono16", 1, 1, 2, "\x03\x05"));
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->ImageCount("label0"), 1);
}

TEST(BagLog, NamesTopicMessageAndStampsThatStepBack) {
  const TempFolder folder;
  BagWriter bag;
  for (const TimeNs t : {10, 30, 20}) {
    bag.Add("/imu0", "sensor_msgs/Imu", 100, ImuMessage(kT0 + t, 0, 0));
  }
  ExpectMalformedFile(ReadAll(folder.Write("log.bag", bag.Finish())).status(),
                      {"/imu0", "message 3", absl::StrCat(kT0 + 20), absl::StrCat(kT0 + 30)});
  BagWriter repeat;
  for (int i = 0; i < 2; ++i) repeat.Add("/imu0", "sensor_msgs/Imu", 1, ImuMessage(kT0, 0, 0));
  ExpectMalformedFile(ReadAll(folder.Write("log.bag", repeat.Finish())).status(), {"message 2"});
}

TEST(BagLog, MergesTopicsThatAreLateByLessThanASecond) {
  const TempFolder folder;
  for (const bool is_too_late : {false, true}) {
    BagWriter bag;
    for (int i = 0; i < 100; ++i) {
      const TimeNs t = kT0 + TimeNs{i} * 50'000'000;
      bag.Add("/imu0", "sensor_msgs/Imu", t, ImuMessage(t, 0, 0));
      const TimeNs late = t - (is_too_late ? 1'200'000'000 : 700'000'000);
      if (i < 30) continue;
      bag.Add("/cam0/image_raw", kImage, t, ImageMessage(late, "mono8", 1, 1, 1, "x"));
    }
    const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
    if (is_too_late) {
      ExpectMalformedFile(log.status(), {"/cam0/image_raw", "more than 1 s before", "clock"});
      continue;
    }
    ASSERT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->order.size(), 170u);
    for (size_t i = 1; i < log->order.size(); ++i) {
      EXPECT_LE(log->order[i - 1].second, log->order[i].second);
    }
  }
}

TEST(BagLog, TakesUnknownTopicsThatCanOnlyBeOneThing) {
  const TempFolder folder;
  BagWriter bag;
  bag.Add("/phone/imu", "sensor_msgs/Imu", 1, ImuMessage(kT0, 0, 0));
  bag.Add("/phone/depth", kImage, 1, ImageMessage(kT0, "16UC1", 1, 1, 2, "\x10\x27"));
  bag.Add("/phone/pose", "geometry_msgs/PoseStamped", 1,
          ByteWriter().Header(kT0, "map").Doubles({1, 2, 3, 0, 0, 0, 1}).bytes());
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->imu.size(), 1u);
  EXPECT_EQ(log->poses.size(), 1u);
  ASSERT_EQ(log->ImageCount("depth0"), 1);
  EXPECT_EQ(DepthAt(*log->images[0].load(), 0, 0), 10.0f);
  EXPECT_TRUE(HasNote(log->info, "the only one of type sensor_msgs/Imu"));
}

TEST(BagLog, TakesTheOnlyLidarWithWhereItSits) {
  const TempFolder folder;
  BagWriter bag;
  bag.Add("/tf_static", "tf2_msgs/TFMessage", 1,
          ByteWriter().U32(1).bytes() +
              TransformBytes(kT0, "base_link", "velodyne", {0.1, 0, 0.6, 0, 0, 0, 1}));
  bag.Add("/points", "sensor_msgs/PointCloud2", 1,
          CloudFields(ByteWriter(), kT0, "velodyne", {{1, 2, 3}}));
  bag.Add("/odom", "nav_msgs/Odometry", 1, OdometryMessage(kT0, {1, 2, 3, 0, 0, 0, 1}));
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->ImageCount("lidar0"), 1);
  EXPECT_EQ(PointAt(*log->images[0].load(), 0, 0), Eigen::Vector3f(1, 2, 3));
  EXPECT_TRUE(HasNote(log->info, "/points, the only one of type sensor_msgs/PointCloud2"));
  ASSERT_TRUE(log->info.rig.lidar.has_value());
  EXPECT_EQ(log->info.rig.lidar->body_T_lidar.position, Eigen::Vector3d(0.1, 0, 0.6));
}

TEST(BagLog, TakesTheTopicsThatAreNamed) {
  const TempFolder folder;
  BagWriter bag;
  bag.Add("/left/imu", "sensor_msgs/Imu", 1, ImuMessage(kT0, 1.0, 0));
  bag.Add("/right/imu", "sensor_msgs/Imu", 1, ImuMessage(kT0, 2.0, 0));
  bag.Add("/front", kImage, 1, ImageMessage(kT0, "16UC1", 1, 1, 2, "\x10\x27"));
  bag.Add("/back", kImage, 1, ImageMessage(kT0, "16UC1", 1, 1, 2, "\x20\x4e"));
  bag.Add("/colour", kImage, 1, ImageMessage(kT0, "rgb8", 1, 1, 3, "abc"));
  bag.Add("/odom", "nav_msgs/Odometry", 1, OdometryMessage(kT0, {1, 2, 3, 0, 0, 0, 1}));
  const std::string path = folder.Write("log.bag", bag.Finish());
  // Of two that could be it, none is guessed.
  const auto guessed = ReadAll(path);
  ASSERT_TRUE(guessed.ok()) << guessed.status();
  EXPECT_EQ(guessed->info.channel_counts,
            (std::map<std::string, int64_t>{{"color0", 1}, {"poses", 1}}));
  LogOptions options;
  options.topics = {{"imu0", "/right/imu"}, {"depth0", "/back"}, {"truth", "/odom"}};
  const auto log = ReadAll(path, options);
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->imu.size(), 1u);
  EXPECT_EQ(log->imu[0].angular_velocity_rad_s.x(), 2.0);
  EXPECT_EQ(log->ImageCount("depth0"), 1);
  EXPECT_EQ(log->ImageCount("color0"), 1);
  EXPECT_TRUE(HasNote(log->info, "ground truth: /odom"));
  EXPECT_NE(log->info.content_sha256, guessed->info.content_sha256);
  options.topics = {{"color0", "none"}, {"poses", "none"}, {"imu0", "/left/imu"}};
  const auto less = ReadAll(path, options);
  ASSERT_TRUE(less.ok()) << less.status();
  EXPECT_EQ(less->info.channel_counts, (std::map<std::string, int64_t>{{"imu0", 1}}));
}

TEST(BagLog, RefusesTopicsThatAreNamedWrongly) {
  const TempFolder folder;
  const std::string path = folder.Write("log.bag", FullBag().Finish());
  const auto expect_refused = [&](const std::map<std::string, std::string>& topics,
                                  const std::string& words) {
    LogOptions options;
    options.topics = topics;
    const absl::Status refused = ReadAll(path, options).status();
    EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
    EXPECT_NE(refused.message().find(words), std::string::npos) << refused;
  };
  expect_refused({{"depth0", "/nowhere"}}, "does not have the topic; it has ");
  expect_refused({{"depth1", "/tesse/odom"}}, "is read as channels cam0, cam1, color0");
  expect_refused({{"depth0", "/tesse/odom"}},
                 "has messages of nav_msgs/Odometry there; depth0 takes "
                 "sensor_msgs/CompressedImage, sensor_msgs/Image");
  expect_refused({{"poses", "/tesse/odom"}, {"truth", "/tesse/odom"}}, "one use for a topic");
  LogOptions options;
  options.topics = {{"depth0", "/depth"}};
  const absl::Status refused =
      OpenLog(folder.Write("log.txt", "1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 1\n"), options).status();
  EXPECT_NE(refused.message().find("has no topics; leave --topic depth0=/depth out"),
            std::string::npos)
      << refused;
}

TEST(BagLog, ReadsCompressedImages) {
  const TempFolder folder;
  std::vector<uint8_t> png;
  cv::imencode(".png", cv::Mat(3, 4, CV_8UC1, cv::Scalar(77)), png);
  BagWriter bag;
  bag.Add("/cam0/image_raw/compressed", "sensor_msgs/CompressedImage", 1,
          ByteWriter()
              .Header(kT0, "cam0")
              .String("mono8; png compressed")
              .String(std::string(png.begin(), png.end()))
              .bytes());
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  const auto image = log->images.at(0).load();
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->bytes, std::vector<uint8_t>(12, 77));
}

std::string PngBytes(int type, double value) {
  std::vector<uint8_t> png;
  EXPECT_TRUE(cv::imencode(".png", cv::Mat(1, 2, type, cv::Scalar(value, value, value)), png));
  return {png.begin(), png.end()};
}

std::string CompressedMessage(const std::string& format, const std::string& data) {
  return ByteWriter().Header(kT0, "cam").String(format).String(data).bytes();
}

// The number and the two parameters of inverse depth that come before the PNG.
std::string DepthParameters(float a, float b) { return std::string(4, '\0') + Floats({a, b}); }

TEST(BagLog, ReadsTheCompressedFormsThatCamerasOfAnyNameHave) {
  constexpr char kCompressed[] = "sensor_msgs/CompressedImage";
  const TempFolder folder;
  BagWriter bag;
  bag.Add("/front/color/compressed", kCompressed, 1,
          CompressedMessage("rgb8; jpeg compressed bgr8", PngBytes(CV_8UC3, 9)));
  // The same depth in three forms: the one without loss counts.
  const std::string millimetres = PngBytes(CV_16UC1, 1500);
  bag.Add("/front/depth/compressed", kCompressed, 1,
          CompressedMessage("16UC1; png compressed ", millimetres));
  bag.Add("/front/depth/compressedDepth", kCompressed, 1,
          CompressedMessage("16UC1; compressedDepth png", DepthParameters(0, 0) + millimetres));
  // Drivers that say how, and not what.
  bag.Add("/rear/grey/compressed", kCompressed, 1, CompressedMessage("png", PngBytes(CV_8UC1, 77)));
  bag.Add("/rear/video", kCompressed, 1, CompressedMessage("h264", "no picture"));
  const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
  ASSERT_TRUE(log.ok()) << log.status();
  const std::map<std::string, int64_t> counts = {{"cam0", 1}, {"color0", 1}, {"depth0", 1}};
  EXPECT_EQ(log->info.channel_counts, counts);
  EXPECT_TRUE(HasNote(log->info, "/front/depth/compressedDepth is taken for depth0"));
  EXPECT_TRUE(HasNote(log->info, "/rear/video (1 sensor_msgs/CompressedImage)"));
  for (const ImageMeasurement& image : log->images) {
    ASSERT_TRUE(image.load().ok()) << image.load().status();
    if (image.channel == "depth0") {
      EXPECT_FLOAT_EQ(DepthAt(*image.load(), 1, 0), 1.5f);
    }
    if (image.channel == "cam0") {
      EXPECT_EQ(image.load()->bytes.at(1), 77);
    }
  }
}

TEST(BagLog, ReadsInverseDepthAndNamesWhatIsNotDepth) {
  const TempFolder folder;
  const auto load = [&](const std::string& format, const std::string& data) {
    BagWriter bag;
    bag.Add("/tesse/depth_cam/mono/image_raw/compressedDepth", "sensor_msgs/CompressedImage", 1,
            CompressedMessage(format, data));
    const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
    EXPECT_TRUE(log.ok()) << log.status();
    EXPECT_EQ(log->ImageCount("depth0"), 1);
    return log->images.at(0).load();
  };
  // 100 / (70 - 20) = 2.
  const auto inverse =
      load("32FC1; compressedDepth png", DepthParameters(100, 20) + PngBytes(CV_16UC1, 70));
  ASSERT_TRUE(inverse.ok()) << inverse.status();
  EXPECT_FLOAT_EQ(DepthAt(*inverse, 1, 0), 2.0f);
  const auto none =
      load("32FC1; compressedDepth", DepthParameters(100, 20) + PngBytes(CV_16UC1, 0));
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_EQ(DepthAt(*none, 1, 0), 0.0f);
  // Behind the camera, and at no distance at all.
  const auto behind =
      load("32FC1; compressedDepth", DepthParameters(100, 70) + PngBytes(CV_16UC1, 70));
  ASSERT_TRUE(behind.ok()) << behind.status();
  EXPECT_EQ(DepthAt(*behind, 1, 0), 0.0f);
  ExpectMalformedFile(load("32FC1; compressedDepth rvl", std::string(99, 'x')).status(),
                      {"RVL", "record it as PNG"});
  ExpectMalformedFile(load("16UC1; compressedDepth png", "short").status(), {"cut short"});
  ExpectMalformedFile(
      load("32FC1; compressedDepth", DepthParameters(1, 1) + PngBytes(CV_8UC1, 7)).status(),
      {"compressedDepth message 1", "depth is 16 bit"});
}

TEST(BagLog, TellsHowFarItIsWhileItLooksThroughTheBag) {
  const TempFolder folder;
  LogOptions options;
  std::vector<int64_t> done;
  options.on_pass = [&done](int64_t count, int64_t total) {
    EXPECT_EQ(total, std::ssize(SmallRecording(CdrWriter(), 5)));
    done.push_back(count);
  };
  const std::string path = folder.Write("log.mcap", WriteMcap(SmallRecording(CdrWriter(), 5)));
  ASSERT_TRUE(OpenLog(path, options).ok());
  ASSERT_FALSE(done.empty());
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
  EXPECT_EQ(done.back(), std::ssize(SmallRecording(CdrWriter(), 5)));
}

TEST(BagLog, ChoosesPosesAsAsked) {
  const TempFolder folder;
  const std::string path = folder.Write("log.bag", FullBag().Finish());
  LogOptions options;
  options.poses = PoseSource::kExternal;
  const absl::Status none = ReadAll(path, options).status();
  EXPECT_EQ(ReasonOf(none), Reason::kFieldInvalid);
  EXPECT_NE(std::string(none.message()).find("--pose-file"), std::string::npos) << none;
  options.pose_file = folder.Write("poses.tum",
                                   "# t x y z qx qy qz qw\n"
                                   "1600000000.02 7 8 9 0 0 0 1\n"
                                   "1600000000.070000001 7 8 9 0 0 0 1\n");
  const auto log = ReadAll(path, options);
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_EQ(log->poses.size(), 2u);
  EXPECT_EQ(log->poses[1].pose.time_ns, kT0 + 70'000'001);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position, Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(log->order.back().first, "poses");
  EXPECT_NE(log->info.content_sha256, OpenLog(path, {}).value()->info().content_sha256);
}

TEST(BagLog, RefusesAPoseFileOfAnotherTime) {
  const TempFolder folder;
  const std::string path = folder.Write("log.bag", FullBag().Finish());
  for (const std::string stamp : {"1500000000.0", "1600003600.0"}) {
    LogOptions options;
    options.pose_file = folder.Write("poses.tum", stamp + " 7 8 9 0 0 0 1\n");
    const absl::Status status = ReadAll(path, options).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << stamp;
    EXPECT_NE(status.message().find(path + " measured from 2020-09-13T12:26:40"), std::string::npos)
        << status;
  }
}

TEST(BagLog, RefusesBadImagesOnlyWhenTheyAreAskedFor) {
  const TempFolder folder;
  const std::pair<std::string, std::string> bad[] = {
      {ImageMessage(kT0, "yuv422", 2, 1, 4, "abcd"), "yuv422"},
      {ImageMessage(kT0, "mono8", 9, 1, 9, "abcd"), "bytes"},
      {ImageMessage(kT0, "32FC1", 1, 1, 4, "abcd"), "does not fit"},
      {ImageMessage(kT0, "mono8", 100000, 100000, 100000, "abcd"), "pixels"}};
  for (const auto& [message, part] : bad) {
    BagWriter bag;
    bag.Add("/cam0/image_raw", kImage, 1, message);
    const auto log = ReadAll(folder.Write("log.bag", bag.Finish()));
    ASSERT_TRUE(log.ok()) << log.status();
    ExpectMalformedFile(log->images.at(0).load().status(), {part, "/cam0/image_raw message 1"});
  }
}

}  // namespace
}  // namespace dsg::ingest
