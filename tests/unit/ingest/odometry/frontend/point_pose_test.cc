// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/point_pose.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/frontend/made_scene.h"

namespace dsg::ingest {
namespace {

struct SeenPoints {
  Pose3d map_T_camera;
  std::vector<PointSight> sights;
  std::vector<bool> is_wrong;
};

// Points as a camera sees them that stands somewhere, the first ones elsewhere.
SeenPoints MakePoints(uint64_t seed, double wrong_share, double noise_px, int count = 120) {
  Random random(seed, 3);
  SeenPoints seen;
  seen.map_T_camera = MotionOf({1.0, -2.0, 0.5}, {20.0, -70.0, 10.0});
  const SceneSpec scene;
  while (static_cast<int>(seen.sights.size()) < count) {
    const Eigen::Vector3d point = ScenePoint(scene, &random);
    const bool is_wrong = static_cast<double>(seen.sights.size()) < wrong_share * count;
    const auto sighting = SightingOf(is_wrong ? ScenePoint(scene, &random) : point);
    if (!sighting.has_value()) continue;
    const Eigen::Vector2d noise(random.Normal(), random.Normal());
    seen.sights.push_back({seen.map_T_camera * point, sighting->pixel + noise_px * noise});
    seen.is_wrong.push_back(is_wrong);
  }
  return seen;
}

TEST(PoseOfPoints, FindsTheCameraBetweenOutliersFromABadGuess) {
  for (const double wrong_share : {0.0, 0.3, 0.6}) {
    for (const uint64_t seed : {1, 2, 3}) {
      const SeenPoints seen = MakePoints(seed, wrong_share, 0.5);
      const PointPose pose = PoseOfPoints(seen.sights, SceneCamera(), Pose3d());
      ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << wrong_share;
      EXPECT_LT((pose.map_T_camera.position - seen.map_T_camera.position).norm(), 0.02);
      EXPECT_LT(DegreesApart(pose.map_T_camera.orientation, seen.map_T_camera.orientation), 0.3);
      int wrong = 0;
      for (const int i : pose.inliers) wrong += seen.is_wrong[static_cast<size_t>(i)] ? 1 : 0;
      EXPECT_LE(wrong, 2);
      // Three standard deviations of each axis.
      EXPECT_GT(static_cast<double>(pose.inliers.size()), 0.95 * (1.0 - wrong_share) * 120.0);
    }
  }
}

TEST(PoseOfPoints, AGoodGuessNeedsFewSamples) {
  const SeenPoints seen = MakePoints(4, 0.6, 0.5);
  const PointPose far = PoseOfPoints(seen.sights, SceneCamera(), Pose3d());
  const PointPose near = PoseOfPoints(seen.sights, SceneCamera(), seen.map_T_camera);
  EXPECT_EQ(near.outcome, PoseOutcome::kFound);
  EXPECT_LE(near.draw_count, far.draw_count);
  EXPECT_LT((near.map_T_camera.position - far.map_T_camera.position).norm(), 1e-3);
}

// The covariance is that of the errors: their squares, in its units, have the mean 6.
TEST(PoseOfPoints, KnowsHowSureItIs) {
  RelativePoseOptions options;
  options.pixel_sigma_px = 0.5;
  double sum = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const SeenPoints seen = MakePoints(100 + static_cast<uint64_t>(run), 0.2, 0.5);
    const PointPose pose = PoseOfPoints(seen.sights, SceneCamera(), Pose3d(), options);
    ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
    Eigen::Matrix<double, 6, 1> error;
    error << pose.map_T_camera.position - seen.map_T_camera.position,
        RotationVectorOf(seen.map_T_camera.orientation.conjugate() * pose.map_T_camera.orientation);
    sum += error.dot(pose.covariance.inverse() * error);
  }
  EXPECT_GT(sum / kRuns, 4.0);
  EXPECT_LT(sum / kRuns, 8.5);
}

TEST(PoseOfPoints, SaysWhenItDoesNotKnow) {
  const SeenPoints seen = MakePoints(5, 0.0, 0.5);
  const std::vector<PointSight> two(seen.sights.begin(), seen.sights.begin() + 2);
  EXPECT_EQ(PoseOfPoints(two, SceneCamera(), Pose3d()).outcome, PoseOutcome::kTooFewPoints);
  const SeenPoints unrelated = MakePoints(6, 1.0, 0.5);
  EXPECT_EQ(PoseOfPoints(unrelated.sights, SceneCamera(), Pose3d()).outcome,
            PoseOutcome::kNoConsensus);
}

TEST(PoseOfPoints, PassesOverNumbersThatAreNone) {
  SeenPoints seen = MakePoints(7, 0.0, 0.5);
  seen.sights[3].pixel.x() = NAN;
  seen.sights[4].point_map.z() = INFINITY;
  const PointPose pose = PoseOfPoints(seen.sights, SceneCamera(), Pose3d());
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  for (const int i : pose.inliers) EXPECT_TRUE(i != 3 && i != 4);
  EXPECT_EQ(pose.inliers.back(), 119);
}

TEST(PoseOfPoints, IsTheSameTwice) {
  const SeenPoints seen = MakePoints(8, 0.5, 0.5);
  const PointPose a = PoseOfPoints(seen.sights, SceneCamera(), Pose3d());
  const PointPose b = PoseOfPoints(seen.sights, SceneCamera(), Pose3d());
  EXPECT_EQ(a.map_T_camera.position, b.map_T_camera.position);
  EXPECT_EQ(a.inliers, b.inliers);
}

}  // namespace
}  // namespace dsg::ingest
