// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/pose_track.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

using Answer = PoseTrack::Answer;

Pose3d Turned(double radians) {
  Pose3d pose;
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitZ()));
  return pose;
}

TEST(PoseTrack, InterpolatesPositionAndTurn) {
  PoseTrack track(500 * kMs, 20.0);
  Pose3d to = Turned(0.4);
  to.position = {1.0, 2.0, 0.0};
  ASSERT_TRUE(track.Add(0, At(0.0)));
  ASSERT_TRUE(track.Add(400 * kMs, to));
  Pose3d pose;
  ASSERT_EQ(track.At(100 * kMs, &pose), Answer::kKnown);
  EXPECT_NEAR((pose.position - Eigen::Vector3d(0.25, 0.5, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(AngleBetween(pose.orientation, Turned(0.1).orientation), 0.0, 1e-9);
}

TEST(PoseTrack, KnowsNothingBeforeTheFirstPoseAndWaitsAfterTheLast) {
  PoseTrack track(500 * kMs, 20.0);
  Pose3d pose;
  EXPECT_EQ(track.At(0, &pose), Answer::kNotYet);
  track.Add(10 * kMs, At(0.0));
  EXPECT_EQ(track.At(9 * kMs, &pose), Answer::kNone);
  EXPECT_EQ(track.At(10 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(track.At(11 * kMs, &pose), Answer::kNotYet);
}

TEST(PoseTrack, DoesNotBridgeAGapButTakesAPoseOfTheSameStamp) {
  PoseTrack track(500 * kMs, 20.0);
  track.Add(0, At(0.0));
  track.Add(501 * kMs, At(100.0));
  Pose3d pose;
  EXPECT_EQ(track.At(250 * kMs, &pose), Answer::kNone);
  ASSERT_EQ(track.At(501 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(pose.position.x(), 100.0);
}

TEST(PoseTrack, ToldAJumpByDistanceAndByTurn) {
  PoseTrack track(500 * kMs, 20.0);
  track.Add(0, At(0.0));
  track.Add(100 * kMs, At(2.5));
  track.Add(200 * kMs, At(4.0));
  Pose3d turned = Turned(2.1);
  turned.position.x() = 4.0;
  track.Add(300 * kMs, turned);
  Pose3d pose;
  EXPECT_EQ(track.At(50 * kMs, &pose), Answer::kJump);
  EXPECT_EQ(track.At(100 * kMs, &pose), Answer::kJump);
  EXPECT_EQ(track.At(150 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(track.At(250 * kMs, &pose), Answer::kJump);
}

TEST(PoseTrack, RefusesBrokenAndLatePoses) {
  PoseTrack track(500 * kMs, 20.0);
  Pose3d broken;
  broken.position.x() = NAN;
  EXPECT_FALSE(track.Add(0, broken));
  EXPECT_TRUE(track.Add(0, At(0.0)));
  EXPECT_FALSE(track.Add(0, At(0.0)));
  EXPECT_FALSE(track.Add(-1, At(0.0)));
}

TEST(PoseTrack, ForgettingChangesNoAnswer) {
  PoseTrack track(500 * kMs, 20.0);
  for (int i = 0; i < 1000; ++i) track.Add(i * kMs, At(0.001 * i));
  track.ForgetBefore(900 * kMs);
  EXPECT_LT(track.size(), 102u);
  Pose3d pose;
  EXPECT_EQ(track.At(900 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(track.At(900 * kMs + 1, &pose), Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 0.9, 1e-6);
}

}  // namespace
}  // namespace dsg::ingest
