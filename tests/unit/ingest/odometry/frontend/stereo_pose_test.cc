// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/stereo_pose.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <iostream>
#include <iterator>
#include <limits>

#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/frontend/made_scene.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kRigSeeds[] = {1, 2, 3, 4, 5};

StereoPose SolveRig(StereoPoseMethod method, const MadeScene& scene) {
  return method == StereoPoseMethod::kThreePoint
             ? ThreePointPose(scene.points)
             : OnePointPose(scene.points, scene.first_T_second.orientation);
}

class StereoPoseTest : public testing::TestWithParam<StereoPoseMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, StereoPoseTest,
                         testing::Values(StereoPoseMethod::kThreePoint,
                                         StereoPoseMethod::kOnePoint),
                         [](const auto& test) {
                           return test.param == StereoPoseMethod::kThreePoint ? "ThreePoint"
                                                                              : "OnePoint";
                         });

TEST_P(StereoPoseTest, FindsTheMotionBetweenOutliers) {
  for (const double outlier_share : {0.0, 0.2, 0.4, 0.6, 0.7}) {
    for (const uint64_t seed : kRigSeeds) {
      const MadeScene scene = MakeScene({.outlier_share = outlier_share, .seed = seed});
      const StereoPose pose = SolveRig(GetParam(), scene);
      const std::string where = testing::PrintToString(std::pair(outlier_share, seed));
      ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << where;
      const Eigen::Vector3d error = pose.first_T_second.position - scene.first_T_second.position;
      EXPECT_LT(error.norm(), 0.1) << where;
      // 1 of 1000 of right ones is larger.
      EXPECT_LT(error.dot(pose.position_covariance.inverse() * error), 16.3) << where;
      EXPECT_LT(DegreesApart(pose.first_T_second.orientation, scene.first_T_second.orientation),
                0.5)
          << where;
      // Far points agree with nearly everything.
      EXPECT_GT(SharesOf(pose.inliers, scene).precision, outlier_share < 0.65 ? 0.9 : 0.8) << where;
      EXPECT_GT(SharesOf(pose.inliers, scene).recall, 0.85) << where;
    }
  }
}

// The covariance is that of the errors: their squares, in its units, have the mean 3.
TEST_P(StereoPoseTest, TellsItsUncertainty) {
  double sum = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const MadeScene scene = MakeScene({.outlier_share = 0.3,
                                       .noise_px = 0.2,
                                       .disparity_noise_px = 0.2,
                                       .seed = static_cast<uint64_t>(100 + run)});
    const StereoPose pose = SolveRig(GetParam(), scene);
    ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << run;
    const Eigen::Vector3d error = pose.first_T_second.position - scene.first_T_second.position;
    sum += error.dot(pose.position_covariance.inverse() * error);
  }
  std::cout << "mean squared error in units of the covariance, of 3: " << sum / kRuns << "\n";
  EXPECT_GT(sum / kRuns, 1.5);
  EXPECT_LT(sum / kRuns, 4.5);
}

TEST_P(StereoPoseTest, PureRotationAndStandstillAreMotionsOfNoLength) {
  for (const Pose3d& motion : {Pose3d(), MotionOf(Eigen::Vector3d::Zero(), {2.0, 8.0, -3.0})}) {
    for (const double outlier_share : {0.0, 0.7}) {
      const MadeScene scene = MakeScene({.outlier_share = outlier_share, .first_T_second = motion});
      const StereoPose pose = SolveRig(GetParam(), scene);
      ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << outlier_share;
      const Eigen::Vector3d& error = pose.first_T_second.position;
      EXPECT_LT(error.dot(pose.position_covariance.inverse() * error), 16.3) << outlier_share;
      EXPECT_LT(DegreesApart(pose.first_T_second.orientation, motion.orientation), 0.5);
    }
  }
}

TEST(CountAgreeing, CountsAsThreePointPoseDoes) {
  for (const uint64_t seed : kRigSeeds) {
    MadeScene scene = MakeScene({.outlier_share = 0.4, .seed = seed});
    const StereoPose pose = ThreePointPose(scene.points);
    ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
    const int agree_count = CountAgreeing(scene.points, pose.first_T_second);
    EXPECT_EQ(agree_count, std::ssize(pose.inliers)) << seed;
    Pose3d turned = pose.first_T_second;
    turned.orientation = turned.orientation * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY());
    EXPECT_LT(CountAgreeing(scene.points, turned), agree_count / 4) << seed;
    scene.points[0].first.point.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_GE(CountAgreeing(scene.points, pose.first_T_second), agree_count - 1) << seed;
  }
}

TEST_P(StereoPoseTest, PlanesAreNoSpecialCase) {
  const MadeScene scene = MakeScene({.outlier_share = 0.4, .is_plane = true});
  const StereoPose pose = SolveRig(GetParam(), scene);
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  EXPECT_LT((pose.first_T_second.position - scene.first_T_second.position).norm(), 0.1);
}

TEST_P(StereoPoseTest, IsTheSameAgain) {
  const MadeScene scene = MakeScene({.outlier_share = 0.6});
  const StereoPose once = SolveRig(GetParam(), scene);
  const StereoPose again = SolveRig(GetParam(), scene);
  EXPECT_EQ(once.inliers, again.inliers);
  EXPECT_EQ(once.first_T_second.position, again.first_T_second.position);
  EXPECT_EQ(once.position_covariance, again.position_covariance);
}

TEST_P(StereoPoseTest, TooFewPointsAreSaid) {
  const size_t least = GetParam() == StereoPoseMethod::kThreePoint ? 3 : 1;
  for (size_t count = 0; count < 10; ++count) {
    MadeScene scene = MakeScene({.count = 30});
    scene.points.resize(count);
    const StereoPose pose = SolveRig(GetParam(), scene);
    EXPECT_EQ(pose.outcome, count < least ? PoseOutcome::kTooFewPoints : PoseOutcome::kNoConsensus)
        << count;
    EXPECT_TRUE(pose.inliers.empty());
  }
}

TEST_P(StereoPoseTest, BrokenPointsNeverAgree) {
  MadeScene scene = MakeScene({.count = 60});
  scene.points[3].first.point.x() = std::numeric_limits<double>::quiet_NaN();
  scene.points[20].second.covariance.setZero();
  const StereoPose pose = SolveRig(GetParam(), scene);
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  for (const int i : pose.inliers) EXPECT_TRUE(i != 3 && i != 20);
  scene.points.assign(40, scene.points[3]);
  EXPECT_EQ(SolveRig(GetParam(), scene).outcome, PoseOutcome::kTooFewPoints);
}

TEST(ThreePointPose, PointsInLineHaveNoRotation) {
  MadeScene scene;
  for (int i = 0; i < 40; ++i) {
    StereoPoint point;
    point.point = Eigen::Vector3d(0.0, 0.0, 1.0 + 0.1 * i);
    point.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    scene.points.push_back({point, point});
  }
  EXPECT_EQ(ThreePointPose(scene.points).outcome, PoseOutcome::kNoConsensus);
  EXPECT_EQ(OnePointPose(scene.points, Eigen::Quaterniond::Identity()).outcome,
            PoseOutcome::kFound);
}

TEST(ThreePointPose, MirroredPointsHaveNoMotion) {
  MadeScene scene = MakeScene({});
  for (StereoPointPair& pair : scene.points) {
    pair.second = pair.first;
    pair.second.point.x() *= -1.0;
  }
  EXPECT_EQ(ThreePointPose(scene.points).outcome, PoseOutcome::kNoConsensus);
}

TEST(StereoPointOf, IsWhereThePixelAndItsDisparitySay) {
  const CameraCalibration camera = SceneCamera();
  const Eigen::Vector3d point(0.7, -0.4, 3.0);
  const Eigen::Vector2d pixel = Project(camera, point);
  const double disparity_px = camera.fx * kSceneBaselineM / point.z();
  for (const double baseline_m : {kSceneBaselineM, -kSceneBaselineM}) {
    const StereoPoint found = StereoPointOf(camera, baseline_m, pixel, disparity_px);
    EXPECT_LT((found.point - point).norm(), 1e-12);
    // Depth errs with its square: z^2 / (f b) of a pixel.
    EXPECT_NEAR(std::sqrt(found.covariance(2, 2)), 9.0 / (camera.fx * kSceneBaselineM), 1e-9);
    EXPECT_TRUE(found.covariance.isApprox(found.covariance.transpose()));
  }
}

TEST(ParseStereoPoseMethod, KnowsTwoNames) {
  EXPECT_EQ(*ParseStereoPoseMethod("3pt"), StereoPoseMethod::kThreePoint);
  EXPECT_EQ(*ParseStereoPoseMethod("1pt"), StereoPoseMethod::kOnePoint);
  EXPECT_EQ(ReasonOf(ParseStereoPoseMethod("").status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
