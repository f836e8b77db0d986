// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/odometry_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/pipeline/log_eye.h"
#include "ingest/trajectory/robot_path.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/log/given_log.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"

namespace dsg::ingest {
namespace {

std::filesystem::path DataFolder(const std::string& name) {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return folder / name;
}

CameraCalibration SmallCamera(const std::string& name, double x_m) {
  CameraCalibration camera{.name = name, .width = 96, .height = 64};
  camera.fx = camera.fy = 60.0;
  camera.cx = 47.5;
  camera.cy = 31.5;
  camera.body_T_camera.position.x() = x_m;
  return camera;
}

LogInfo PairInfo() {
  LogInfo info;
  info.format = "euroc";
  info.path = "room";
  info.content_sha256 = "00";
  info.rig.cameras = {SmallCamera("cam0", 0.0), SmallCamera("cam1", 0.1)};
  info.rig.imu = ImuCalibration{"imu0", 200.0, 1e-3, 1e-5, 1e-2, 1e-4, {}};
  info.channel_counts = {{"cam0", 3}, {"cam1", 3}, {"imu0", 5}};
  return info;
}

ImageMeasurement Picture(TimeNs time_ns, const std::string& channel, bool is_broken = false) {
  ImageMeasurement image{time_ns, channel, "picture", {}};
  image.load = [is_broken]() -> absl::StatusOr<Image> {
    if (is_broken) return absl::InvalidArgumentError("is no picture");
    Image picture{96, 64, PixelFormat::kGray8, {}};
    picture.bytes.assign(picture.Offset(0, 64), 90);
    return picture;
  };
  return image;
}

TEST(OdometryLog, KeepsAllMeasurementsInOrderAndCountsWhatItCannotUse) {
  std::deque<Measurement> given;
  for (int i = 0; i < 40; ++i) {
    const double rate = i == 30 ? std::numeric_limits<double>::infinity() : 0.0;
    given.push_back(ImuMeasurement{i * 10'000'000, {rate, 0, 0}, {0, 0, 9.81}});
    if (i % 10 == 5) given.push_back(Picture(i * 10'000'000 + 1, "cam0", /*is_broken=*/i == 15));
    // One has no partner.
    if (i % 10 == 5 && i != 25) given.push_back(Picture(i * 10'000'000 + 1, "cam1"));
  }
  // After the last sample.
  given.push_back(Picture(900'000'000, "cam0"));
  given.push_back(Picture(900'000'000, "cam1"));
  const size_t count = given.size();
  auto log = EstimatePoses(std::make_unique<GivenLog>(PairInfo(), given), {}, {});
  ASSERT_TRUE(log.ok()) << log.status();
  const ReadLog outcome = ReadAll(**log);
  // Grey walls tell nothing.
  ASSERT_EQ(outcome.measurements.size(), count);
  for (size_t i = 1; i < count; ++i) {
    EXPECT_LE(StampOf(outcome.measurements[i - 1]), StampOf(outcome.measurements[i]));
  }
  EXPECT_TRUE(HasNote(outcome.info, "1 images of cam0 and cam1 have no partner"));
  EXPECT_TRUE(HasNote(outcome.info, "1 images were passed over; the first: is no picture"));
  EXPECT_TRUE(HasNote(outcome.info, "1 images have no inertial samples beside them"));
  EXPECT_TRUE(HasNote(outcome.info, "1 inertial samples were left out"));
  EXPECT_TRUE(HasNote(outcome.info, "poses of 0 of 2 images"));
}

// The unit falls silent for good: what comes after is not held back until the end of the log.
TEST(OdometryLog, DoesNotWaitForSamplesThatNeverCome) {
  std::deque<Measurement> given;
  for (int i = 0; i < 20; ++i) {
    given.push_back(ImuMeasurement{i * 5'000'000, {0, 0, 0}, {0, 0, 9.81}});
  }
  for (int i = 1; i <= 10; ++i) {
    given.push_back(Picture(i * kNsPerSecond, "cam0"));
    given.push_back(Picture(i * kNsPerSecond, "cam1"));
  }
  auto source = std::make_unique<GivenLog>(PairInfo(), given);
  const GivenLog& given_log = *source;
  auto log = EstimatePoses(std::move(source), {}, {});
  ASSERT_TRUE(log.ok()) << log.status();
  for (int i = 0; i < 22; ++i) ASSERT_TRUE((*log)->Next().ok());
  // The first pair has come, and of the other nine some have not been asked for.
  const auto third = (*log)->Next();
  ASSERT_TRUE(third.ok() && third->has_value());
  EXPECT_EQ(StampOf(**third), 2 * kNsPerSecond);
  EXPECT_GE(given_log.left_count(), 10u);
  EXPECT_TRUE(HasNote(ReadAll(**log).info, "10 images have no inertial samples beside them"));
}

TEST(OdometryLog, LeavesOutThePosesOfTheLog) {
  LogInfo info = PairInfo();
  info.channel_counts["poses"] = 1;
  std::deque<Measurement> given;
  PoseMeasurement pose;
  pose.agent_name = "body";
  pose.agent_kind = kinds::kRobot;
  pose.pose.time_ns = 10;
  given.push_back(pose);
  given.push_back(ImuMeasurement{20, {0, 0, 0}, {0, 0, 9.81}});
  auto log = EstimatePoses(std::make_unique<GivenLog>(info, given), {}, {});
  ASSERT_TRUE(log.ok()) << log.status();
  const ReadLog outcome = ReadAll(**log);
  ASSERT_EQ(outcome.measurements.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<ImuMeasurement>(outcome.measurements.front()));
}

TEST(OdometryLog, IsAnotherLogWithOtherOptions) {
  const auto sha_of = [](const OdometryLogOptions& options) {
    auto log = EstimatePoses(std::make_unique<GivenLog>(PairInfo(), std::deque<Measurement>()), {},
                             options);
    EXPECT_TRUE(log.ok()) << log.status();
    return (*log)->info().content_sha256;
  };
  OdometryLogOptions two_points;
  two_points.odometry.method = OdometryMethod::kTwoPoint;
  OdometryLogOptions unmasked;
  unmasked.is_masked = false;
  OdometryLogOptions longer;
  longer.odometry.window.keyframe_count = 20;
  EXPECT_EQ(sha_of({}), sha_of({}));
  EXPECT_NE(sha_of({}), sha_of(two_points));
  EXPECT_NE(sha_of({}), sha_of(unmasked));
  EXPECT_NE(sha_of({}), sha_of(longer));
}

TEST(OdometryLog, RefusesLogsThatTellNoMotion) {
  const auto refusal_of = [](const LogInfo& info) {
    const auto log =
        EstimatePoses(std::make_unique<GivenLog>(info, std::deque<Measurement>()), {}, {});
    EXPECT_EQ(log.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(log.status().message());
  };
  LogInfo without_pair = PairInfo();
  without_pair.rig.cameras.pop_back();
  without_pair.channel_counts.erase("cam1");
  EXPECT_NE(refusal_of(without_pair).find("neither a pair of cameras"), std::string::npos);
  LogInfo without_noise = PairInfo();
  without_noise.rig.imu->gyro_noise_density = -1.0;
  refusal_of(without_noise);
}

TEST(OdometryLog, WritesAnEmptyMeshWhereNothingIsSeen) {
  const test::TempFolder folder;
  OdometryLogOptions options;
  options.mesh = OdometryMeshOptions{{}, folder.path() + "/near.ply", {}};
  auto log =
      EstimatePoses(std::make_unique<GivenLog>(PairInfo(), std::deque<Measurement>()), {}, options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(std::filesystem::exists(options.mesh->file));
  EXPECT_TRUE(HasNote(ReadAll(**log).info, "odometry mesh: no keyframe had a pose"));
  EXPECT_TRUE(std::filesystem::exists(options.mesh->file));
  const auto again =
      EstimatePoses(std::make_unique<GivenLog>(PairInfo(), std::deque<Measurement>()), {}, options);
  EXPECT_NE(again.status().message().find("is there already"), std::string::npos) << again.status();
  options.mesh->file = folder.path() + "/missing/near.ply";
  const auto refused =
      EstimatePoses(std::make_unique<GivenLog>(PairInfo(), std::deque<Measurement>()), {}, options);
  EXPECT_NE(refused.status().message().find("name a folder you may write to"), std::string::npos)
      << refused.status();
}

// A wall with a pattern, 2 m before a camera with depth; depth comes `late_ns` after its image.
struct WallLog {
  LogInfo info;
  std::deque<Measurement> given;
};

WallLog MakeWallLog(int count, TimeNs late_ns) {
  WallLog wall;
  wall.info.format = "tum-rgbd";
  wall.info.path = "wall";
  wall.info.content_sha256 = "00";
  wall.info.rig.cameras = {SmallCamera("color0", 0.0), SmallCamera("depth0", 0.0)};
  wall.info.channel_counts = {{"color0", count}, {"depth0", count}};
  for (int i = 0; i < count; ++i) {
    const TimeNs time_ns = kNsPerSecond + i * TimeNs{33'000'000};
    ImageMeasurement color = Picture(time_ns, "color0");
    color.load = [i]() -> absl::StatusOr<Image> {
      // It moves aside by a pixel an image.
      return PaintedImage(96, 64,
                          [i](int u, int v) { return WaveTexture((u + i) / 7.0, v / 7.0); });
    };
    ImageMeasurement depth = Picture(time_ns + late_ns, "depth0");
    depth.load = []() -> absl::StatusOr<Image> {
      Image picture{96, 64, PixelFormat::kDepth16, {}};
      for (int k = 0; k < 96 * 64; ++k) {
        picture.bytes.push_back(2000 & 0xff);
        picture.bytes.push_back(2000 >> 8);
      }
      return picture;
    };
    wall.given.push_back(late_ns < 0 ? depth : color);
    wall.given.push_back(late_ns < 0 ? color : depth);
  }
  return wall;
}

ReadLog PlacedWall(const WallLog& wall, const OdometryLogOptions& options = {}) {
  auto log = EstimatePoses(std::make_unique<GivenLog>(wall.info, wall.given), {}, options);
  EXPECT_TRUE(log.ok()) << log.status();
  return ReadAll(**log);
}

std::vector<PoseMeasurement> PosesOf(const ReadLog& read) {
  std::vector<PoseMeasurement> poses;
  for (const Measurement& measurement : read.measurements) {
    if (const auto* pose = std::get_if<PoseMeasurement>(&measurement)) poses.push_back(*pose);
  }
  return poses;
}

// The camera is level: its right is the odometry frame's -y. A pixel is 2 m / 60.
TEST(OdometryLog, PlacesACameraWithDepthAndWithoutAnInertialUnit) {
  OdometryLogOptions options;
  options.odometry.frontend.tracker.cell_px = 8;
  options.odometry.frontend.tracker.apart_px_min = 6.0;
  for (const TimeNs late_ns : {-13'700'000, 0, 13'700'000}) {
    const ReadLog read = PlacedWall(MakeWallLog(8, late_ns), options);
    const std::vector<PoseMeasurement> poses = PosesOf(read);
    ASSERT_EQ(poses.size(), 8u);
    for (size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(poses[i].pose.time_ns, kNsPerSecond + static_cast<TimeNs>(i) * 33'000'000);
      const Eigen::Vector3d due(0.0, -2.0 / 60.0 * static_cast<double>(i), 0.0);
      EXPECT_LT((poses[i].pose.map_T_agent.position - due).norm(), 0.01) << i;
      EXPECT_NE(poses[i].pose.covariance, nullptr);
    }
    for (size_t i = 1; i < read.measurements.size(); ++i) {
      EXPECT_LE(StampOf(read.measurements[i - 1]), StampOf(read.measurements[i]));
    }
    EXPECT_TRUE(HasNote(read.info, "estimated from color0 and depth0 alone"));
    EXPECT_TRUE(HasNote(read.info, "poses of 8 of 8 images"));
    // One wall may be seen from anywhere.
    EXPECT_TRUE(HasNote(read.info, "does not show what is up"));
  }
}

TEST(OdometryLog, LeavesDepthOfAnotherTimeAlone) {
  const ReadLog read = PlacedWall(MakeWallLog(1, 21'000'000));
  EXPECT_TRUE(PosesOf(read).empty());
  EXPECT_TRUE(HasNote(read.info, "2 images of color0 and depth0 have no partner"));
}

TEST(OdometryLog, UsesNoInertialUnitThatItIsToldNotToOrThatHasNoCalibration) {
  const auto notes_of = [](const LogInfo& info, const OdometryLogOptions& options) {
    auto log =
        EstimatePoses(std::make_unique<GivenLog>(info, std::deque<Measurement>()), {}, options);
    EXPECT_TRUE(log.ok()) << log.status();
    return (*log)->info();
  };
  EXPECT_TRUE(HasNote(notes_of(PairInfo(), {}), "cam0, cam1 and imu0"));
  OdometryLogOptions by_images;
  by_images.is_inertial = false;
  EXPECT_TRUE(HasNote(notes_of(PairInfo(), by_images), "cam0 and cam1 alone"));
  LogInfo without = PairInfo();
  without.rig.imu.reset();
  EXPECT_TRUE(HasNote(notes_of(without, {}), "cam0 and cam1 alone"));
  EXPECT_TRUE(HasNote(notes_of(without, {}), "imu0 has no calibration"));
}

TEST(OdometryLog, TakesAConsumerUnitsNoiseWhereTheLogTellsNone) {
  LogInfo quiet = PairInfo();
  quiet.rig.imu = ImuCalibration{"imu0", 200.0, 0.0, 0.0, 0.0, 0.0, {}};
  std::deque<Measurement> given;
  for (int i = 0; i < 40; ++i) {
    given.push_back(ImuMeasurement{i * 5'000'000, {0, 0, 0}, {0, 0, 9.81}});
  }
  auto log = EstimatePoses(std::make_unique<GivenLog>(quiet, given), {}, {});
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(HasNote((*log)->info(), "does not tell all noise of imu0"));
  auto known = EstimatePoses(std::make_unique<GivenLog>(PairInfo(), given), {}, {});
  ASSERT_TRUE(known.ok()) << known.status();
  EXPECT_FALSE(HasNote((*known)->info(), "does not tell all noise"));
}

TEST(ImagePairing, TakesTheNearestImageThatHasNoNearerOneItself) {
  const auto pairs_of = [](const std::vector<std::pair<std::string, TimeNs>>& images) {
    ImagePairing pairing("color0", "depth0", /*with_labels=*/false, /*apart_ns_max=*/20);
    for (const auto& [channel, time_ns] : images) pairing.Add(Picture(time_ns, channel));
    std::vector<std::pair<TimeNs, TimeNs>> pairs;
    while (!pairing.empty()) {
      const PairedImages pair = pairing.Take();
      pairs.emplace_back(pair.left.has_value() ? pair.left->time_ns : -1,
                         pair.other.has_value() ? pair.other->time_ns : -1);
      EXPECT_TRUE(!pair.left.has_value() || pair.time_ns == pair.left->time_ns);
    }
    return pairs;
  };
  using Pairs = std::vector<std::pair<TimeNs, TimeNs>>;
  EXPECT_EQ(pairs_of({{"color0", 100}, {"depth0", 114}, {"color0", 133}, {"depth0", 147}}),
            (Pairs{{100, 114}, {133, 147}}));
  EXPECT_EQ(pairs_of({{"depth0", 90}, {"color0", 100}, {"depth0", 125}, {"color0", 133}}),
            (Pairs{{100, 90}, {133, 125}}));
  // The second image is nearer to it.
  EXPECT_EQ(pairs_of({{"color0", 100}, {"depth0", 118}, {"color0", 120}}),
            (Pairs{{100, -1}, {120, 118}}));
  EXPECT_EQ(pairs_of({{"color0", 100}, {"depth0", 121}}), (Pairs{{100, -1}, {-1, 121}}));
  EXPECT_EQ(pairs_of({{"color0", 100}, {"depth0", 100}}), (Pairs{{100, 100}}));
}

TEST(ImagePairing, WaitsUntilNoNearerImageMayCome) {
  ImagePairing pairing("color0", "depth0", /*with_labels=*/false, /*apart_ns_max=*/20);
  pairing.Add(Picture(100, "color0"));
  pairing.Add(Picture(140, "depth0"));
  EXPECT_TRUE(pairing.IsOpen(100));
  pairing.Add(Picture(141, "color0"));
  EXPECT_FALSE(pairing.IsOpen(100));
}

// Of the whole path of a log, moved as the first pose says, largest error in metres; and how many
// poses there are.
struct PathError {
  double largest_m = 0.0;
  double largest_rad = 0.0;
  size_t count = 0;
};

PathError ErrorOf(const std::filesystem::path& folder, const OdometryLogOptions& odometry) {
  PathError error;
  RobotPath truth;
  LogOptions options;
  options.poses = PoseSource::kGroundTruth;
  auto true_log = OpenLog(folder.string(), options);
  EXPECT_TRUE(true_log.ok()) << true_log.status();
  for (const PoseMeasurement& pose : PosesOf(ReadAll(**true_log))) truth.Add(pose.pose);
  options.poses = PoseSource::kOdometry;
  auto opened = OpenLog(folder.string(), options);
  EXPECT_TRUE(opened.ok()) << opened.status();
  auto log = EstimatePoses(*std::move(opened), options, odometry);
  EXPECT_TRUE(log.ok()) << log.status();
  const ReadLog read = ReadAll(**log);
  for (const std::string& note : read.info.notes) std::cout << note << "\n";
  std::optional<Pose3d> truth_T_odom;
  for (const PoseMeasurement& pose : PosesOf(read)) {
    Pose3d map_T_body;
    if (truth.At(pose.pose.time_ns, &map_T_body) != RobotPath::Answer::kKnown) continue;
    if (!truth_T_odom.has_value()) truth_T_odom = map_T_body * pose.pose.map_T_agent.Inverse();
    const Pose3d moved = *truth_T_odom * pose.pose.map_T_agent;
    error.largest_m = std::max(error.largest_m, (moved.position - map_T_body.position).norm());
    error.largest_rad =
        std::max(error.largest_rad, AngleBetween(moved.orientation, map_T_body.orientation));
    ++error.count;
  }
  return error;
}

// A second of TUM's fr1_rpy: turns of 58 degrees over a desk.
TEST(OdometryLog, IsWithinCentimetresOfTheGroundTruthOfARealDepthCamera) {
  const std::filesystem::path folder = DataFolder("rgbd-tum") / "freiburg1_rpy";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  const PathError error = ErrorOf(folder, {});
  std::cout << "fr1_rpy: largest error " << error.largest_m << " m, " << error.largest_rad
            << " rad\n";
  EXPECT_EQ(error.count, 18u);
  EXPECT_LT(error.largest_m, 0.05);
  EXPECT_LT(error.largest_rad, 0.075);
}

// Eight seconds of EuRoC's MH_01, in motion from the first image on.
class EurocOdometry : public testing::TestWithParam<OdometryMethod> {};

TEST_P(EurocOdometry, IsWithinCentimetresOfTheGroundTruth) {
  const std::filesystem::path folder = DataFolder("euroc-mh01-stereo");
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  OdometryLogOptions odometry;
  odometry.odometry.method = GetParam();
  const PathError error = ErrorOf(folder, odometry);
  std::cout << "euroc: largest error " << error.largest_m << " m\n";
  EXPECT_GT(error.count, 150u);
  EXPECT_LT(error.largest_m, 0.15);
}

TEST(OdometryLog, SaysThatItsImagesAreLateOnTheClockOfTheUnit) {
  if (!std::filesystem::is_directory(DataFolder("euroc-mh01-stereo"))) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  LogOptions options;
  options.poses = PoseSource::kOdometry;
  auto opened = OpenLog(DataFolder("euroc-mh01-stereo").string(), options);
  ASSERT_TRUE(opened.ok()) << opened.status();
  const ReadLog read = ReadAll(**opened);
  const auto notes_with = [&](TimeNs unit_late_ns) {
    std::deque<Measurement> measurements(read.measurements.begin(), read.measurements.end());
    for (Measurement& measurement : measurements) {
      if (auto* sample = std::get_if<ImuMeasurement>(&measurement)) sample->time_ns += unit_late_ns;
    }
    std::stable_sort(
        measurements.begin(), measurements.end(),
        [](const Measurement& a, const Measurement& b) { return StampOf(a) < StampOf(b); });
    auto log =
        EstimatePoses(std::make_unique<GivenLog>(read.info, std::move(measurements)), options, {});
    EXPECT_TRUE(log.ok()) << log.status();
    return ReadAll(**log).info;
  };
  EXPECT_FALSE(HasNote(notes_with(0), "on the clock of the inertial unit"));
  const LogInfo late = notes_with(20'000'000);
  for (const std::string& note : late.notes) std::cout << note << "\n";
  EXPECT_TRUE(HasNote(late, "20 ms after their stamps") || HasNote(late, "19 ms after"));
}

TEST(EurocMesh, HoldsWhatIsNearAndLeavesThePosesAsTheyAre) {
  if (!std::filesystem::is_directory(DataFolder("euroc-mh01-stereo"))) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  const test::TempFolder folder;
  LogOptions options;
  options.poses = PoseSource::kOdometry;
  const auto read_with = [&](const OdometryLogOptions& odometry) {
    auto opened = OpenLog(DataFolder("euroc-mh01-stereo").string(), options);
    EXPECT_TRUE(opened.ok()) << opened.status();
    auto log = EstimatePoses(*std::move(opened), options, odometry);
    EXPECT_TRUE(log.ok()) << log.status();
    return ReadAll(**log);
  };
  OdometryLogOptions with;
  size_t keyframe_count = 0;
  size_t least_triangles = SIZE_MAX;
  with.mesh = OdometryMeshOptions{{}, folder.path() + "/near.ply", [&](const MeshMoment& moment) {
                                    if (++keyframe_count < 3) return;
                                    least_triangles =
                                        std::min(least_triangles, moment.mesh->triangle_count());
                                  }};
  const ReadLog meshed = read_with(with);
  const ReadLog bare = read_with({});
  EXPECT_GT(keyframe_count, 10u);
  EXPECT_GT(least_triangles, 20u);
  EXPECT_TRUE(HasNote(meshed.info, "ms of processor time each"));
  for (const std::string& note : meshed.info.notes) std::cout << note << "\n";
  EXPECT_EQ(meshed.info.content_sha256, bare.info.content_sha256);
  ASSERT_EQ(meshed.measurements.size(), bare.measurements.size());
  for (size_t i = 0; i < bare.measurements.size(); ++i) {
    const auto* a = std::get_if<PoseMeasurement>(&meshed.measurements[i]);
    const auto* b = std::get_if<PoseMeasurement>(&bare.measurements[i]);
    ASSERT_EQ(a == nullptr, b == nullptr);
    if (a != nullptr) {
      EXPECT_EQ(a->pose.map_T_agent.position, b->pose.map_T_agent.position);
    }
  }
  EXPECT_NE(test::ReadFile(with.mesh->file).find("comment metres, z up, the frame of the robot's"),
            std::string::npos);
  const auto soup = ReadPly(test::ReadFile(with.mesh->file), with.mesh->file);
  ASSERT_TRUE(soup.ok()) << soup.status();
  EXPECT_GT(soup->faces.size(), 20u);
}

INSTANTIATE_TEST_SUITE_P(Methods, EurocOdometry,
                         testing::Values(OdometryMethod::kFivePoint, OdometryMethod::kTwoPoint,
                                         OdometryMethod::kDynamic));

}  // namespace
}  // namespace dsg::ingest
