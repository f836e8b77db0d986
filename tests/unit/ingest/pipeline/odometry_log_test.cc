// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/odometry_log.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iostream>
#include <utility>
#include <variant>

#include "ingest/trajectory/robot_path.h"
#include "tests/unit/ingest/pipeline/given_log.h"

namespace dsg::ingest {
namespace {

std::filesystem::path ExcerptFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return folder / "euroc-mh01-stereo";
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
    given.push_back(ImuMeasurement{i * 10'000'000, {0, 0, 0}, {0, 0, 9.81}});
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
  LogInfo without_unit = PairInfo();
  without_unit.rig.imu.reset();
  EXPECT_NE(refusal_of(without_unit).find("no inertial unit"), std::string::npos);
  LogInfo without_pair = PairInfo();
  without_pair.rig.cameras.pop_back();
  without_pair.channel_counts.erase("cam1");
  EXPECT_NE(refusal_of(without_pair).find("neither a pair of cameras"), std::string::npos);
  LogInfo without_noise = PairInfo();
  without_noise.rig.imu->gyro_noise_density = -1.0;
  refusal_of(without_noise);
}

// Eight seconds of EuRoC's MH_01, in motion from the first image on.
class EurocOdometry : public testing::TestWithParam<OdometryMethod> {};

TEST_P(EurocOdometry, IsWithinCentimetresOfTheGroundTruth) {
  if (!std::filesystem::is_directory(ExcerptFolder())) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  RobotPath truth;
  {
    LogOptions options;
    options.poses = PoseSource::kGroundTruth;
    auto log = OpenLog(ExcerptFolder().string(), options);
    ASSERT_TRUE(log.ok()) << log.status();
    for (const Measurement& measurement : ReadAll(**log).measurements) {
      if (const auto* pose = std::get_if<PoseMeasurement>(&measurement)) truth.Add(pose->pose);
    }
  }
  LogOptions options;
  options.poses = PoseSource::kOdometry;
  OdometryLogOptions odometry;
  odometry.odometry.method = GetParam();
  auto opened = OpenLog(ExcerptFolder().string(), options);
  ASSERT_TRUE(opened.ok()) << opened.status();
  auto log = EstimatePoses(*std::move(opened), options, odometry);
  ASSERT_TRUE(log.ok()) << log.status();
  const ReadLog outcome = ReadAll(**log);
  std::vector<Pose3d> estimates;
  std::vector<Pose3d> truths;
  for (const Measurement& measurement : outcome.measurements) {
    const auto* pose = std::get_if<PoseMeasurement>(&measurement);
    if (pose == nullptr) continue;
    Pose3d map_T_body;
    ASSERT_EQ(truth.At(pose->pose.time_ns, &map_T_body), RobotPath::Answer::kKnown);
    estimates.push_back(pose->pose.map_T_agent);
    truths.push_back(map_T_body);
  }
  for (const std::string& note : outcome.info.notes) std::cout << note << "\n";
  ASSERT_GT(estimates.size(), 150u);
  // Moved as the first pose says: the whole drift is counted.
  const Pose3d truth_T_odom = truths.front() * estimates.front().Inverse();
  double largest_m = 0.0;
  for (size_t i = 0; i < estimates.size(); ++i) {
    largest_m =
        std::max(largest_m, ((truth_T_odom * estimates[i]).position - truths[i].position).norm());
  }
  std::cout << "euroc: largest error " << largest_m << " m\n";
  EXPECT_LT(largest_m, 0.15);
}

INSTANTIATE_TEST_SUITE_P(Methods, EurocOdometry,
                         testing::Values(OdometryMethod::kFivePoint, OdometryMethod::kTwoPoint,
                                         OdometryMethod::kDynamic));

}  // namespace
}  // namespace dsg::ingest
