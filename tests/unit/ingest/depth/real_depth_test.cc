// SPDX-License-Identifier: Apache-2.0
// Depth frames, stereo and gravity of recorded logs. Figures are printed; bounds are what the
// data's README files and a look at the pictures allow.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>

#include "ingest/depth/cloud_views.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/depth/gravity.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {
namespace {

std::filesystem::path DataFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

class RealDepth : public testing::Test {
 protected:
  void SetUp() override {
    if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
};

struct Frames {
  std::vector<DepthFrame> frames;
  SkipCounts skips;
};

// What a folder leaves out.
struct Patch {
  std::optional<RigCalibration> rig;
  bool stands_still = false;
};

// Every `every`-th depth frame of a log, at most `count`.
Frames ReadFrames(const std::string& path, int every, size_t count, const Patch& patch = {}) {
  Frames result;
  absl::StatusOr<std::unique_ptr<LogSource>> log = OpenLog((DataFolder() / path).string(), {});
  EXPECT_TRUE(log.ok()) << log.status();
  if (!log.ok()) return result;
  RobotPath robot;
  FrameMaker maker(patch.rig.value_or((*log)->info().rig), {}, robot);
  EXPECT_TRUE(maker.CanMakeFrames()) << path;
  int index = 0;
  const auto take = [&] {
    while (std::optional<DepthFrame> frame = maker.Next()) {
      if (index++ % every == 0 && result.frames.size() < count) {
        result.frames.push_back(*std::move(frame));
      }
    }
  };
  while (result.frames.size() < count) {
    absl::StatusOr<std::optional<Measurement>> next = (*log)->Next();
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !next->has_value()) break;
    if (const auto* pose = std::get_if<PoseMeasurement>(&**next)) {
      if (robot.Add(pose->pose)) maker.NotePose();
    } else if (auto* image = std::get_if<ImageMeasurement>(&**next)) {
      if (patch.stands_still && image->channel == "depth0") {
        robot.Add({.time_ns = image->time_ns});
        maker.NotePose();
      }
      maker.AddPicture({image->time_ns, image->channel, image->origin, std::move(image->load)});
    }
    take();
  }
  maker.Finish();
  take();
  result.skips = maker.skips();
  return result;
}

struct Readings {
  double share = 0.0;
  double median_m = 0.0;
};

Readings ReadingsOf(const std::vector<DepthFrame>& frames) {
  std::vector<float> depths;
  size_t pixel_count = 0;
  for (const DepthFrame& frame : frames) {
    pixel_count += frame.depth_m.size();
    for (const float depth_m : frame.depth_m) {
      EXPECT_TRUE(std::isfinite(depth_m));
      if (depth_m > 0.0f) depths.push_back(depth_m);
    }
  }
  if (depths.empty()) return {};
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return {static_cast<double>(depths.size()) / static_cast<double>(pixel_count), *middle};
}

// Median difference between a frame's depth and the other frame's depth warped into it, metres.
double WarpErrorM(const DepthFrame& from, const DepthFrame& to) {
  const Pose3d to_T_from = to.map_T_camera.Inverse() * from.map_T_camera;
  std::vector<double> errors;
  const int width = from.camera.width;
  for (int v = 0; v < from.camera.height; v += 4) {
    for (int u = 0; u < width; u += 4) {
      const double depth_m = from.depth_m[static_cast<size_t>(v * width + u)];
      if (depth_m <= 0.0) continue;
      const Eigen::Vector3d ray((u - from.camera.cx) / from.camera.fx,
                                (v - from.camera.cy) / from.camera.fy, 1.0);
      const Eigen::Vector3d point = to_T_from * Eigen::Vector3d(depth_m * ray);
      if (point.z() <= 0.1) continue;
      const Eigen::Vector2d at = Project(to.camera, point);
      const int x = static_cast<int>(std::lround(at.x()));
      const int y = static_cast<int>(std::lround(at.y()));
      if (x < 0 || y < 0 || x >= to.camera.width || y >= to.camera.height) continue;
      const double there_m = to.depth_m[static_cast<size_t>(y * to.camera.width + x)];
      if (there_m > 0.0) errors.push_back(std::abs(there_m - point.z()));
    }
  }
  if (errors.size() < 100) return 1e9;
  std::nth_element(errors.begin(), errors.begin() + std::ssize(errors) / 2, errors.end());
  return errors[errors.size() / 2];
}

double MedianWarpM(const std::vector<DepthFrame>& frames) {
  std::vector<double> errors;
  for (size_t i = 1; i < frames.size(); ++i) {
    errors.push_back(WarpErrorM(frames[i - 1], frames[i]));
  }
  std::sort(errors.begin(), errors.end());
  return errors.empty() ? 1e9 : errors[errors.size() / 2];
}

double DegreesBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180.0 / M_PI;
}

TEST_F(RealDepth, SevenScenesFramesAgreeWithEachOther) {
  const Frames log = ReadFrames("rgbd-7scenes", 1, 10);
  ASSERT_EQ(log.frames.size(), 10u);
  EXPECT_TRUE(log.skips.empty());
  EXPECT_FALSE(log.frames[0].rgb.empty());
  const Readings readings = ReadingsOf(log.frames);
  const double warp_m = MedianWarpM(log.frames);
  std::cout << "7-scenes: readings " << readings.share << " median " << readings.median_m
            << " m, warp error " << warp_m << " m\n";
  EXPECT_NEAR(readings.share, 0.89, 0.06);
  EXPECT_LT(warp_m, 0.01);
}

TEST_F(RealDepth, SevenScenesGravityIsWithinThreeDegrees) {
  std::ifstream file(DataFolder() / "rgbd-7scenes/gravity-direction.txt");
  Eigen::Vector3d truth;
  file >> truth.x() >> truth.y() >> truth.z();
  ASSERT_TRUE(file);
  // The file points down: with the poses' y along the images' rows downwards, it is mostly +y.
  for (const int every : {2, 8}) {
    const auto up = EstimateUp(ReadFrames("rgbd-7scenes", every, 15).frames);
    ASSERT_TRUE(up.has_value()) << every;
    std::cout << "7-scenes: gravity off by " << DegreesBetween(-*up, truth) << " degrees\n";
    EXPECT_LT(DegreesBetween(-*up, truth), 3.0) << every;
  }
}

double UpErrorDegrees(const std::string& name, const Frames& log, const Eigen::Vector3d& truth) {
  for (const auto& [reason, count] : log.skips)
    std::cout << name << ": " << reason << " " << count << "\n";
  const std::optional<Eigen::Vector3d> up = EstimateUp(log.frames);
  const double error = up.has_value() ? DegreesBetween(*up, truth) : 180.0;
  std::cout << name << ": " << log.frames.size() << " frames, up off by " << error << " degrees\n";
  return error;
}

TEST_F(RealDepth, UpOfRenderedRoomsIsFound) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  EXPECT_LT(UpErrorDegrees("replica", ReadFrames("rgbd-replica-office0", 1, 2), z), 1.0);
  // The origin of these poses is the first camera, which was held about level.
  EXPECT_LT(UpErrorDegrees("livingroom", ReadFrames("rgbd-livingroom1", 5, 20),
                           -Eigen::Vector3d::UnitY()),
            5.0);
}

TEST_F(RealDepth, UpOfKimerasFramesIsFound) {
  absl::StatusOr<std::unique_ptr<LogSource>> log =
      OpenLog((DataFolder() / "uhumans2-tesse/rgbd").string(), {});
  ASSERT_TRUE(log.ok()) << log.status();
  RigCalibration rig = (*log)->info().rig;
  for (CameraCalibration& camera : rig.cameras) camera.body_T_camera = Pose3d();
  // These have no poses: up in the camera's frame, which the simulated robot carries level.
  const Frames still = ReadFrames("uhumans2-tesse/rgbd", 1, 2, {rig, true});
  EXPECT_EQ(still.frames.size(), 2u);
  EXPECT_LT(UpErrorDegrees("tesse rgbd", still, -Eigen::Vector3d::UnitY()), 3.0);
  // These have no calibration, but were taken with the same camera.
  const Frames pair = ReadFrames("uhumans2-tesse/loop_pair", 1, 2, {rig, false});
  EXPECT_EQ(pair.frames.size(), 2u);
  EXPECT_LT(UpErrorDegrees("tesse pair", pair, Eigen::Vector3d::UnitZ()), 3.0);
}

TEST_F(RealDepth, EurocPairsGiveDepth) {
  const Frames log = ReadFrames("euroc-mh01-stereo", 2, 6);
  ASSERT_EQ(log.frames.size(), 6u);
  for (const DepthFrame& frame : log.frames) {
    EXPECT_TRUE(frame.is_stereo);
    EXPECT_EQ(frame.rgb.size(), 3 * frame.depth_m.size());
  }
  const Readings readings = ReadingsOf(log.frames);
  const double warp_m = MedianWarpM(log.frames);
  std::cout << "euroc: readings " << readings.share << " median " << readings.median_m
            << " m, warp error " << warp_m << " m\n";
  EXPECT_GT(readings.share, 0.45);
  EXPECT_GT(readings.median_m, 0.4);
  EXPECT_LT(readings.median_m, 2.5);
  EXPECT_LT(warp_m, 0.03);
}

// 64 beams, x y z intensity as floats.
std::vector<Eigen::Vector3f> ReadScan(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<Eigen::Vector3f> points;
  for (Eigen::Vector4f point; in.read(reinterpret_cast<char*>(point.data()), sizeof(float) * 4);) {
    points.push_back(point.head<3>());
  }
  return points;
}

// Nearest of `points`, metres.
double Nearest(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& to) {
  float nearest = 1e9f;
  for (const Eigen::Vector3f& point : points) nearest = std::min(nearest, (point - to).norm());
  return nearest;
}

TEST_F(RealDepth, ViewsOfAScanLieWhereItsPointsDo) {
  const std::vector<Eigen::Vector3f> points =
      ReadScan(DataFolder() / "lidar-scans" / "sequence" / "000000.bin");
  if (points.empty()) GTEST_SKIP() << "no lidar-scans";
  Image image{static_cast<int>(points.size()), 1, PixelFormat::kPoints32, {}};
  image.bytes.resize(12 * points.size());
  std::memcpy(image.bytes.data(), points.data(), image.bytes.size());
  const std::vector<DepthFrame> views = ViewsOfCloud(image, 0, {}, {});
  ASSERT_GE(views.size(), 4u);
  int64_t reading_count = 0;
  std::vector<double> shares;
  for (const DepthFrame& view : views) {
    for (size_t i = 0; i < view.depth_m.size(); ++i) {
      const float depth_m = view.depth_m[i];
      if (depth_m <= 0.0f) continue;
      if (++reading_count % 400 != 0) continue;
      const CameraCalibration& camera = view.camera;
      const Eigen::Vector3d seen((static_cast<double>(i % 256) - camera.cx) / camera.fx * depth_m,
                                 (static_cast<double>(i / 256) - camera.cy) / camera.fy * depth_m,
                                 depth_m);
      const Eigen::Vector3f at = (view.map_T_camera * seen).cast<float>();
      shares.push_back(Nearest(points, at) / at.norm());
    }
  }
  std::sort(shares.begin(), shares.end());
  std::cout << reading_count << " readings of " << points.size() << " points; off by "
            << 100.0 * shares[shares.size() / 2] << " % of the range in the median, "
            << 100.0 * shares[shares.size() * 95 / 100] << " % at 95 %\n";
  // A pixel is 0.45 degrees, 0.8 % of the range; beams are 0.4 degrees apart.
  EXPECT_LT(shares[shares.size() / 2], 0.01);
  EXPECT_LT(shares[shares.size() * 95 / 100], 0.03);
  EXPECT_GT(reading_count, 40'000);
}

}  // namespace
}  // namespace dsg::ingest
