// SPDX-License-Identifier: Apache-2.0
// What is put between the beams of a lidar is where the surfaces are.
#include "ingest/depth/cloud_views.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "ingest/depth/frame_maker.h"
#include "tests/unit/ingest/depth/depth_test_util.h"
#include "tests/unit/ingest/depth/made_scan.h"

namespace dsg::ingest {
namespace {

Image CloudOf(const std::vector<Eigen::Vector3f>& points) {
  Image image{static_cast<int>(points.size()), 1, PixelFormat::kPoints32, {}};
  image.bytes.resize(12 * points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    std::memcpy(image.bytes.data() + 12 * i, points[i].data(), 12);
  }
  return image;
}

Pose3d LidarPose() {
  Pose3d pose;
  pose.position = {0.4, 1.2, 1.1};
  pose.orientation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  return pose;
}

// Calls visit(point in the map, row) for each reading of a frame.
template <typename Visit>
void ForEachReading(const DepthFrame& frame, const Visit& visit) {
  for (int row = 0; row < frame.camera.height; ++row) {
    for (int column = 0; column < frame.camera.width; ++column) {
      const double depth_m = frame.depth_m[static_cast<size_t>(row * frame.camera.width + column)];
      if (depth_m <= 0.0) continue;
      const Eigen::Vector3d seen((column - frame.camera.cx) / frame.camera.fx * depth_m,
                                 (row - frame.camera.cy) / frame.camera.fy * depth_m, depth_m);
      visit(frame.map_T_camera * seen, row);
    }
  }
}

TEST(CloudViews, LieOnTheSurfacesAndFillTheBand) {
  const std::vector<DepthFrame> frames =
      ViewsOfCloud(CloudOf(MadeScan(LidarPose())), 7, LidarPose(), {});
  // Nothing is seen above and below.
  ASSERT_EQ(frames.size(), 4u);
  for (const DepthFrame& frame : frames) {
    EXPECT_EQ(frame.time_ns, 7);
    EXPECT_TRUE(frame.camera.Validate().ok());
    int64_t count = 0, off_count = 0, band_count = 0;
    // The band of 15 degrees, in the middle of the picture.
    const int band = static_cast<int>(frame.camera.fy * std::tan(0.24));
    ForEachReading(frame, [&](const Eigen::Vector3d& point, int row) {
      ++count;
      // Half a pixel at 5 m, at a slant.
      if (OffSurface(point) > 0.04) ++off_count;
      if (std::abs(row - frame.camera.cy) < band) ++band_count;
    });
    EXPECT_GT(band_count, 0.93 * 2 * band * frame.camera.width);
    // Edges of the pillar may be bridged by a pixel.
    EXPECT_LT(off_count, 0.005 * static_cast<double>(count)) << count;
  }
}

TEST(CloudViews, LeaveOutWhatIsNoReading) {
  std::vector<Eigen::Vector3f> points(100, Eigen::Vector3f(0.1f, 0.1f, 0.1f));
  EXPECT_TRUE(ViewsOfCloud(CloudOf(points), 0, {}, {}).empty());
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = {2.0f, 0.01f * static_cast<float>(i), 0.0f};
    if (i % 3 == 1) points[i].y() = std::numeric_limits<float>::quiet_NaN();
    if (i % 3 == 2) points[i] *= 1e30f;
  }
  const std::vector<DepthFrame> frames = ViewsOfCloud(CloudOf(points), 0, {}, {});
  ASSERT_EQ(frames.size(), 1u);
  ForEachReading(frames[0],
                 [](const Eigen::Vector3d& point, int) { EXPECT_NEAR(point.x(), 2.0, 1e-5); });
  EXPECT_TRUE(ViewsOfCloud(CloudOf({}), 0, {}, {}).empty());
  CloudOptions options;
  EXPECT_TRUE(ValidateOptions(options).ok());
  options.reading_count_min = 10000.0;
  EXPECT_TRUE(ViewsOfCloud(CloudOf(points), 0, {}, options).empty());
}

TEST(CloudViews, AreToAllSides) {
  std::vector<Eigen::Vector3f> points;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      for (int i = 0; i < 40; ++i) {
        Eigen::Vector3f point;
        point[axis] = 2.0f * sign;
        point[(axis + 1) % 3] = 0.02f * static_cast<float>(i);
        point[(axis + 2) % 3] = -0.3f;
        points.push_back(point);
      }
    }
  }
  const std::vector<DepthFrame> frames = ViewsOfCloud(CloudOf(points), 0, LidarPose(), {});
  ASSERT_EQ(frames.size(), 6u);
  size_t reading_count = 0;
  for (const DepthFrame& frame : frames) {
    EXPECT_NEAR(frame.map_T_camera.orientation.norm(), 1.0, 1e-6);
    ForEachReading(frame, [&](const Eigen::Vector3d& point, int) {
      ++reading_count;
      const Eigen::Vector3f seen = (LidarPose().Inverse() * point).cast<float>();
      float nearest = 1.0f;
      for (const Eigen::Vector3f& given : points) {
        nearest = std::min(nearest, (given - seen).norm());
      }
      EXPECT_LT(nearest, 0.02f);
    });
  }
  EXPECT_GT(reading_count, 200u);
}

TEST(FrameMaker, MakesTheViewsOfALidarOneAfterAnother) {
  RigCalibration rig;
  rig.lidar.emplace().name = "lidar0";
  rig.lidar->body_T_lidar.position = {0.0, 0.0, 0.6};
  PosedFrameMaker maker(rig, {});
  ASSERT_TRUE(maker.CanMakeFrames());
  Pose3d map_T_body = LidarPose();
  map_T_body.position.z() -= 0.6;
  for (int i = 0; i <= 3; ++i) maker.AddPose(i * 100'000'000, map_T_body);
  for (int i = 0; i < 3; ++i) {
    maker.AddPicture({i * 100'000'000, "lidar0", "scan", [i]() -> absl::StatusOr<Image> {
                        if (i == 1) return CloudOf({});
                        return CloudOf(MadeScan(LidarPose()));
                      }});
  }
  maker.Finish();
  std::vector<TimeNs> times;
  while (const std::optional<DepthFrame> frame = maker.Next()) {
    times.push_back(frame->time_ns);
    EXPECT_LT((frame->map_T_camera.position - LidarPose().position).norm(), 1e-9);
  }
  EXPECT_EQ(times,
            (std::vector<TimeNs>{0, 0, 0, 0, 200'000'000, 200'000'000, 200'000'000, 200'000'000}));
  EXPECT_EQ(maker.skips(), (SkipCounts{{"broken image", 1}}));
}

}  // namespace
}  // namespace dsg::ingest
