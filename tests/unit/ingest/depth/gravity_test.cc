// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/gravity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "ingest/sensor/pinhole.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

constexpr double kDegree = M_PI / 180.0;

// A room, z up: floor at 0, ceiling at 2.6, walls at x = -3, 3 and y = -2, 2.
double RoomHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d low(-3.0, -2.0, 0.0);
  const Eigen::Vector3d high(3.0, 2.0, 2.6);
  double nearest = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const double limit = ray[axis] > 0.0 ? high[axis] : low[axis];
    if (ray[axis] != 0.0) nearest = std::min(nearest, (limit - origin[axis]) / ray[axis]);
  }
  return nearest;
}

// From the middle of the room, at eye height; roll, pitch (down) and yaw in degrees.
DepthFrame Look(double yaw, double pitch, double roll, Random* random, double noise = 0.002) {
  DepthFrame frame;
  frame.camera = TestCamera("depth0", 320, 240);
  Eigen::Matrix3d level;  // Camera axes at yaw 0: x right = -y, y down = -z, z forward = x.
  level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  frame.map_T_camera.position = {0.3, -0.2, 1.5};
  frame.map_T_camera.orientation = Eigen::AngleAxisd(yaw * kDegree, Eigen::Vector3d::UnitZ()) *
                                   Eigen::Quaterniond(level) *
                                   Eigen::AngleAxisd(-pitch * kDegree, Eigen::Vector3d::UnitX()) *
                                   Eigen::AngleAxisd(roll * kDegree, Eigen::Vector3d::UnitZ());
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector3d ray = frame.map_T_camera.orientation * PinholeRay(frame.camera, u, v);
      const double depth_m = RoomHit(frame.map_T_camera.position, ray);
      frame.depth_m.push_back(
          static_cast<float>(depth_m + noise * depth_m * depth_m * random->Normal()));
    }
  }
  return frame;
}

double ErrorDegrees(const std::optional<Eigen::Vector3d>& up, const Eigen::Vector3d& truth) {
  return up.has_value() ? std::acos(std::clamp(up->dot(truth), -1.0, 1.0)) / kDegree : 180.0;
}

TEST(EstimateUp, FindsTheFloorOfARoomInWhateverFrame) {
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed, 1);
    std::vector<DepthFrame> frames;
    for (int i = 0; i < 6; ++i) {
      frames.push_back(Look(random.Uniform(0.0, 360.0), random.Uniform(5.0, 40.0),
                            random.Uniform(-8.0, 8.0), &random));
    }
    const Eigen::Quaterniond any =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
            .normalized();
    for (DepthFrame& frame : frames) {
      frame.map_T_camera.orientation = any * frame.map_T_camera.orientation;
      frame.map_T_camera.position = any * frame.map_T_camera.position;
    }
    EXPECT_LT(ErrorDegrees(EstimateUp(frames), any * Eigen::Vector3d::UnitZ()), 1.0)
        << "seed " << seed;
  }
}

TEST(EstimateUp, CamerasThatLookFarDownStillFindIt) {
  for (const double pitch : {40.0, 50.0, 60.0}) {
    Random random(5, 1);
    std::vector<DepthFrame> frames;
    for (const double yaw : {0.0, 15.0, 40.0}) frames.push_back(Look(yaw, pitch, 4.0, &random));
    EXPECT_LT(ErrorDegrees(EstimateUp(frames), Eigen::Vector3d::UnitZ()), 1.0) << pitch;
  }
}

// Far from its default each number makes another answer for one of these cameras, or none.
TEST(EstimateUp, ReadsEachOfItsNumbers) {
  Random random(5, 1);
  std::vector<std::vector<DepthFrame>> cameras;
  cameras.push_back({Look(20.0, 15.0, 4.0, &random), Look(140.0, 30.0, -6.0, &random)});
  cameras.push_back({Look(0.0, 50.0, 0.0, &random, 0.01), Look(90.0, 60.0, 10.0, &random, 0.01)});
  cameras.push_back({Look(0.0, 20.0, 0.0, &random), Look(0.0, 20.0, 170.0, &random)});
  const auto estimate = [&cameras](const GravityOptions& options) {
    std::vector<std::optional<Eigen::Vector3d>> ups;
    for (const std::vector<DepthFrame>& frames : cameras)
      ups.push_back(EstimateUp(frames, options));
    return ups;
  };
  const auto usual = estimate({});
  EXPECT_TRUE(usual[0].has_value());
  GravityOptions options;
  for (const BoundOption& field : options.Bind()) {
    const double before = field.Get();
    field.Set(field.max);
    bool is_read = estimate(options) != usual;
    field.Set(field.min);
    is_read = is_read || estimate(options) != usual;
    field.Set(before);
    EXPECT_TRUE(is_read) << field.name;
  }
}

TEST(EstimateUp, DoesNotAnswerWithoutAnythingLevel) {
  Random random(6, 1);
  EXPECT_FALSE(EstimateUp({}).has_value());
  // A wall alone.
  DepthFrame wall = Look(0.0, 0.0, 0.0, &random);
  wall.depth_m.assign(wall.depth_m.size(), 2.0f);
  EXPECT_FALSE(EstimateUp({wall}).has_value());
  // No reading.
  wall.depth_m.assign(wall.depth_m.size(), 0.0f);
  EXPECT_FALSE(EstimateUp({wall}).has_value());
  // Nothing flat.
  for (float& depth_m : wall.depth_m) depth_m = static_cast<float>(random.Uniform(1.0, 3.0));
  EXPECT_FALSE(EstimateUp({wall}).has_value());
}

TEST(EstimateUp, DoesNotAnswerWhenTheCameraWasHeldInAllWays) {
  Random random(7, 1);
  EXPECT_FALSE(
      EstimateUp({Look(0.0, 20.0, 0.0, &random), Look(0.0, 20.0, 180.0, &random)}).has_value());
}

}  // namespace
}  // namespace dsg::ingest
