// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/relative_pose.h"

#include <gtest/gtest.h>

#include <iostream>
#include <limits>
#include <numeric>

#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/frontend/made_scene.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kSeeds[] = {1, 2, 3, 4, 5};

const double kFocalPx = SceneCamera().fx;

MonoPose Solve(MonoPoseMethod method, const MadeScene& scene,
               const RelativePoseOptions& options = {}) {
  return method == MonoPoseMethod::kFivePoint
             ? FivePointPose(scene.bearings, kFocalPx, options)
             : TwoPointPose(scene.bearings, scene.first_T_second.orientation, kFocalPx, options);
}

class MonoPoseTest : public testing::TestWithParam<MonoPoseMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, MonoPoseTest,
                         testing::Values(MonoPoseMethod::kFivePoint, MonoPoseMethod::kTwoPoint),
                         [](const auto& test) {
                           return test.param == MonoPoseMethod::kFivePoint ? "FivePoint"
                                                                           : "TwoPoint";
                         });

TEST_P(MonoPoseTest, FindsTheMotionBetweenOutliers) {
  for (const double outlier_share : {0.0, 0.2, 0.4, 0.6, 0.7}) {
    for (const uint64_t seed : kSeeds) {
      const MadeScene scene = MakeScene({.outlier_share = outlier_share, .seed = seed});
      const MonoPose pose = Solve(GetParam(), scene);
      const std::string where = testing::PrintToString(std::pair(outlier_share, seed));
      ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << where;
      EXPECT_NEAR(pose.first_T_second.position.norm(), 1.0, 1e-9) << where;
      EXPECT_LT(DegreesApart(pose.first_T_second.position, scene.first_T_second.position), 2.0)
          << where;
      EXPECT_LT(DegreesApart(pose.first_T_second.orientation, scene.first_T_second.orientation),
                0.3)
          << where;
      EXPECT_FALSE(pose.twin_first_T_second.has_value()) << where;
      EXPECT_TRUE(std::is_sorted(pose.inliers.begin(), pose.inliers.end()));
      const InlierShares shares = SharesOf(pose.inliers, scene);
      // An outlier lies near its epipolar line by accident.
      EXPECT_GT(shares.precision, outlier_share < 0.65 ? 0.9 : 0.8) << where;
      EXPECT_GT(shares.recall, 0.95) << where;
    }
  }
}

TEST_P(MonoPoseTest, IsExactWithoutNoise) {
  const MadeScene scene = MakeScene({.outlier_share = 0.5, .noise_px = 0.0});
  const MonoPose pose = Solve(GetParam(), scene);
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  EXPECT_LT(DegreesApart(pose.first_T_second.position, scene.first_T_second.position), 0.1);
  EXPECT_EQ(SharesOf(pose.inliers, scene).recall, 1.0);
}

TEST_P(MonoPoseTest, IsTheSameAgain) {
  const MadeScene scene = MakeScene({.outlier_share = 0.6});
  const MonoPose once = Solve(GetParam(), scene);
  const MonoPose again = Solve(GetParam(), scene);
  EXPECT_EQ(once.inliers, again.inliers);
  EXPECT_EQ(once.draw_count, again.draw_count);
  EXPECT_EQ(once.first_T_second.position, again.first_T_second.position);
  EXPECT_EQ(once.first_T_second.orientation.coeffs(), again.first_T_second.orientation.coeffs());
}

TEST_P(MonoPoseTest, PureRotationHasNoTranslation) {
  for (const double outlier_share : {0.0, 0.3, 0.7}) {
    for (const double noise_px : {0.0, 0.1, 0.5}) {
      for (const uint64_t seed : kSeeds) {
        const MadeScene scene =
            MakeScene({.outlier_share = outlier_share,
                       .noise_px = noise_px,
                       .first_T_second = MotionOf(Eigen::Vector3d::Zero(), {2.0, 8.0, -3.0}),
                       .seed = seed});
        const MonoPose pose = Solve(GetParam(), scene);
        const std::string where = testing::PrintToString(std::tuple(outlier_share, noise_px, seed));
        ASSERT_EQ(pose.outcome, PoseOutcome::kNoTranslation) << where;
        EXPECT_TRUE(pose.first_T_second.position.isZero()) << where;
        EXPECT_LT(DegreesApart(pose.first_T_second.orientation, scene.first_T_second.orientation),
                  0.1)
            << where;
        EXPECT_GT(SharesOf(pose.inliers, scene).precision, 0.9) << where;
        EXPECT_GT(SharesOf(pose.inliers, scene).recall, 0.95) << where;
        EXPECT_LT(pose.parallax_px, 1.5) << where;
      }
    }
  }
}

TEST_P(MonoPoseTest, StandstillHasNoTranslation) {
  for (const double outlier_share : {0.0, 0.5}) {
    for (const uint64_t seed : kSeeds) {
      const MadeScene scene =
          MakeScene({.outlier_share = outlier_share, .first_T_second = Pose3d(), .seed = seed});
      const MonoPose pose = Solve(GetParam(), scene);
      ASSERT_EQ(pose.outcome, PoseOutcome::kNoTranslation) << outlier_share << " " << seed;
      EXPECT_TRUE(pose.first_T_second.position.isZero());
      EXPECT_LT(DegreesApart(pose.first_T_second.orientation, Eigen::Quaterniond::Identity()), 0.1);
    }
  }
}

TEST_P(MonoPoseTest, AWayOfMillimetresIsNoTranslation) {
  // A tenth of a pixel at 4 m.
  const MadeScene scene = MakeScene(
      {.noise_px = 0.1, .first_T_second = MotionOf({0.001, 0.0, 0.0}, Eigen::Vector3d::Zero())});
  EXPECT_EQ(Solve(GetParam(), scene).outcome, PoseOutcome::kNoTranslation);
}

TEST_P(MonoPoseTest, TooFewPointsAreSaid) {
  const MadeScene scene = MakeScene({.count = 30});
  const size_t least = GetParam() == MonoPoseMethod::kFivePoint ? 5 : 2;
  for (size_t count = 0; count < 10; ++count) {
    MadeScene few = scene;
    few.bearings.resize(count);
    const MonoPose pose = Solve(GetParam(), few);
    EXPECT_EQ(pose.outcome, count < least ? PoseOutcome::kTooFewPoints : PoseOutcome::kNoConsensus)
        << count;
    EXPECT_TRUE(pose.inliers.empty()) << count;
  }
}

TEST_P(MonoPoseTest, UnrelatedPointsHaveNoMotion) {
  for (const uint64_t seed : kSeeds) {
    const MadeScene scene = MakeScene({.count = 100, .outlier_share = 1.0, .seed = seed});
    const MonoPose pose = Solve(GetParam(), scene);
    EXPECT_EQ(pose.outcome, PoseOutcome::kNoConsensus) << seed;
    EXPECT_TRUE(pose.inliers.empty()) << seed;
  }
}

TEST_P(MonoPoseTest, EqualPointsAndBrokenOnesDoNotCrash) {
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  MadeScene scene;
  scene.bearings.assign(40, {ahead, ahead});
  EXPECT_EQ(Solve(GetParam(), scene).outcome, PoseOutcome::kNoTranslation);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.bearings.assign(40, {Eigen::Vector3d(nan, 0.0, 1.0), ahead});
  EXPECT_EQ(Solve(GetParam(), scene).outcome, PoseOutcome::kTooFewPoints);
  scene.bearings.assign(40, {Eigen::Vector3d::Zero(), ahead});
  EXPECT_EQ(Solve(GetParam(), scene).outcome, PoseOutcome::kTooFewPoints);
}

TEST_P(MonoPoseTest, BrokenPointsKeepTheNumbersOfTheOthers) {
  MadeScene scene = MakeScene({.count = 60});
  scene.bearings[3].first.x() = std::numeric_limits<double>::infinity();
  scene.bearings[20].second.setZero();
  const MonoPose pose = Solve(GetParam(), scene);
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  std::vector<int> expected(60);
  std::iota(expected.begin(), expected.end(), 0);
  std::erase_if(expected, [](int i) { return i == 3 || i == 20; });
  EXPECT_EQ(pose.inliers, expected);
}

TEST(TwoPointPose, FindsTheMotionOverAPlane) {
  for (const uint64_t seed : kSeeds) {
    const MadeScene scene = MakeScene({.outlier_share = 0.4, .is_plane = true, .seed = seed});
    const MonoPose pose = Solve(MonoPoseMethod::kTwoPoint, scene);
    ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << seed;
    EXPECT_LT(DegreesApart(pose.first_T_second.position, scene.first_T_second.position), 1.0)
        << seed;
    EXPECT_FALSE(pose.twin_first_T_second.has_value()) << seed;
  }
}

// The inliers are right, and the motion is one of the two that a plane allows. On a plane noise
// counts much: a turn moves its points nearly as a translation does.
TEST(FivePointPose, TellsBothMotionsOverAPlane) {
  int twin_count = 0;
  for (const uint64_t seed : kSeeds) {
    const MadeScene scene =
        MakeScene({.outlier_share = 0.4, .noise_px = 0.1, .is_plane = true, .seed = seed});
    const MonoPose pose = Solve(MonoPoseMethod::kFivePoint, scene);
    ASSERT_EQ(pose.outcome, PoseOutcome::kFound) << seed;
    EXPECT_GT(SharesOf(pose.inliers, scene).precision, 0.9) << seed;
    EXPECT_GT(SharesOf(pose.inliers, scene).recall, 0.95) << seed;
    const Eigen::Vector3d& truth = scene.first_T_second.position;
    double error = DegreesApart(pose.first_T_second.position, truth);
    std::cout << "plane, seed " << seed << ": off by " << error << " degrees";
    if (pose.twin_first_T_second.has_value()) {
      ++twin_count;
      const double twin_error = DegreesApart(pose.twin_first_T_second->position, truth);
      std::cout << ", the twin by " << twin_error;
      error = std::min(error, twin_error);
    }
    std::cout << "\n";
    EXPECT_LT(error, 6.0) << seed;
  }
  EXPECT_GT(twin_count, 0);
}

// RSS 2020, section III-A: why people in the picture ask for the rotation of the gyroscope.
TEST(TwoPointPose, IsAsGoodAsFivePointInCrowdsWithFewerSamples) {
  double two_sum = 0.0;
  double five_sum = 0.0;
  for (const uint64_t seed : kSeeds) {
    const MadeScene scene = MakeScene({.outlier_share = 0.7, .noise_px = 0.5, .seed = seed});
    const MonoPose two = Solve(MonoPoseMethod::kTwoPoint, scene);
    const MonoPose five = Solve(MonoPoseMethod::kFivePoint, scene);
    ASSERT_EQ(two.outcome, PoseOutcome::kFound) << seed;
    const double two_error =
        DegreesApart(two.first_T_second.position, scene.first_T_second.position);
    const double five_error =
        five.outcome == PoseOutcome::kFound
            ? DegreesApart(five.first_T_second.position, scene.first_T_second.position)
            : 90.0;
    std::cout << "seed " << seed << ": 2pt off by " << two_error << " degrees after "
              << two.draw_count << " samples, 5pt by " << five_error << " after " << five.draw_count
              << "\n";
    EXPECT_LT(two_error, 3.0) << seed;
    EXPECT_LT(10 * two.draw_count, five.draw_count) << seed;
    two_sum += two_error;
    five_sum += five_error;
  }
  EXPECT_LE(two_sum, five_sum);
}

// What integration of a gyroscope errs by between two keyframes.
TEST(TwoPointPose, BearsTheErrorOfAGyroscope) {
  const MadeScene scene = MakeScene({.outlier_share = 0.5});
  const Eigen::Quaterniond off = scene.first_T_second.orientation *
                                 Eigen::AngleAxisd(5e-4, Eigen::Vector3d(1, 1, 1).normalized());
  const MonoPose pose = TwoPointPose(scene.bearings, off, kFocalPx);
  ASSERT_EQ(pose.outcome, PoseOutcome::kFound);
  EXPECT_LT(DegreesApart(pose.first_T_second.position, scene.first_T_second.position), 1.0);
  EXPECT_GT(SharesOf(pose.inliers, scene).recall, 0.95);
  EXPECT_EQ(pose.first_T_second.orientation.coeffs(), off.coeffs());
}

TEST(ParseMonoPoseMethod, KnowsTwoNames) {
  EXPECT_EQ(*ParseMonoPoseMethod("5pt"), MonoPoseMethod::kFivePoint);
  EXPECT_EQ(*ParseMonoPoseMethod("2pt"), MonoPoseMethod::kTwoPoint);
  EXPECT_EQ(ReasonOf(ParseMonoPoseMethod("8pt").status()), Reason::kFieldInvalid);
}

TEST(FrontendOptions, DefaultsAreWithinTheirRanges) {
  EXPECT_TRUE(ValidateOptions(FrontendOptions()).ok());
  EXPECT_EQ(DigestOptions(FrontendOptions()), "");
  FrontendOptions options;
  options.relative_pose.consensus.seed = 7;
  EXPECT_EQ(DigestOptions(options), "odometry-consensus-seed=7");
}

}  // namespace
}  // namespace dsg::ingest
