// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/robot_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::ingest {
namespace {

using Answer = RobotPath::Answer;

constexpr TimeNs kMs = 1'000'000;

Pose3d At(double x_m) {
  Pose3d pose;
  pose.position.x() = x_m;
  return pose;
}

bool Add(TimeNs time_ns, const Pose3d& pose, RobotPath* path) {
  return path->Add({.time_ns = time_ns, .map_T_agent = pose});
}

Pose3d Turned(double radians) {
  Pose3d pose;
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitZ()));
  return pose;
}

TEST(RobotPath, InterpolatesPositionAndTurn) {
  RobotPath path({.gap_ns_max = 500 * kMs, .speed_m_s_max = 20.0});
  Pose3d to = Turned(0.4);
  to.position = {1.0, 2.0, 0.0};
  ASSERT_TRUE(Add(0, At(0.0), &path));
  ASSERT_TRUE(Add(400 * kMs, to, &path));
  Pose3d pose;
  ASSERT_EQ(path.At(100 * kMs, &pose), Answer::kKnown);
  EXPECT_NEAR((pose.position - Eigen::Vector3d(0.25, 0.5, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(AngleBetween(pose.orientation, Turned(0.1).orientation), 0.0, 1e-9);
}

TEST(RobotPath, KnowsNothingBeforeTheFirstPoseAndWaitsAfterTheLast) {
  RobotPath path({.gap_ns_max = 500 * kMs, .speed_m_s_max = 20.0});
  Pose3d pose;
  EXPECT_EQ(path.At(0, &pose), Answer::kNotYet);
  Add(10 * kMs, At(0.0), &path);
  EXPECT_EQ(path.At(9 * kMs, &pose), Answer::kNone);
  EXPECT_EQ(path.At(10 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(path.At(11 * kMs, &pose), Answer::kNotYet);
}

TEST(RobotPath, DoesNotBridgeAGapButTakesAPoseOfTheSameStamp) {
  RobotPath path({.gap_ns_max = 500 * kMs, .speed_m_s_max = 20.0});
  Add(0, At(0.0), &path);
  Add(501 * kMs, At(100.0), &path);
  Pose3d pose;
  EXPECT_EQ(path.At(250 * kMs, &pose), Answer::kNone);
  ASSERT_EQ(path.At(501 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(pose.position.x(), 100.0);
}

TEST(RobotPath, ToldAJumpByDistanceAndByTurn) {
  RobotPath path({.gap_ns_max = 500 * kMs, .speed_m_s_max = 20.0});
  Add(0, At(0.0), &path);
  Add(100 * kMs, At(2.5), &path);
  Add(200 * kMs, At(4.0), &path);
  Pose3d turned = Turned(2.1);
  turned.position.x() = 4.0;
  Add(300 * kMs, turned, &path);
  Pose3d pose;
  EXPECT_EQ(path.At(50 * kMs, &pose), Answer::kJump);
  EXPECT_EQ(path.At(100 * kMs, &pose), Answer::kJump);
  EXPECT_EQ(path.At(150 * kMs, &pose), Answer::kKnown);
  EXPECT_EQ(path.At(250 * kMs, &pose), Answer::kJump);
}

TEST(RobotPath, RefusesBrokenAndLatePoses) {
  RobotPath path({.gap_ns_max = 500 * kMs, .speed_m_s_max = 20.0});
  Pose3d broken;
  broken.position.x() = NAN;
  EXPECT_FALSE(Add(0, broken, &path));
  EXPECT_TRUE(Add(0, At(0.0), &path));
  EXPECT_FALSE(Add(0, At(0.0), &path));
  EXPECT_FALSE(Add(-1, At(0.0), &path));
}

TEST(RobotPath, CountsWhatItRefuses) {
  RobotPath path;
  Add(0, At(0.0), &path);
  Add(0, At(0.0), &path);
  EXPECT_EQ(path.refused_count(), 1);
  EXPECT_EQ(path.poses().size(), 1u);
}

// The robot went 10 m, by odometry 11: a correction pulls the way back in, ever more along it.
TEST(RobotPath, LiesInTheMapWhereItsCorrectionSays) {
  RobotPath path;
  for (int i = 0; i <= 110; ++i) Add(i * 100 * kMs, At(0.1 * i), &path);
  const TimeNs end_ns = 11'000 * kMs;
  const TrajectoryChange correction({0, end_ns}, {At(0.0), At(11.0)}, {At(0.0), At(10.0)});
  const TrajectoryChange change = path.ChangeTo(correction);
  path.Correct(correction);
  EXPECT_NEAR(change.largest_m(), 1.0, 1e-12);
  Pose3d pose;
  ASSERT_EQ(path.At(5'500 * kMs, &pose), Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 5.0, 1e-9);
  ASSERT_EQ(path.GivenAt(5'500 * kMs, &pose), Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 5.5, 1e-9);
  // What comes after the last keyframe keeps its distance from it.
  Add(end_ns + 100 * kMs, At(11.1), &path);
  ASSERT_EQ(path.At(end_ns + 100 * kMs, &pose), Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 10.1, 1e-9);
  EXPECT_NEAR(path.InMap(path.poses().back()).map_T_agent.position.x(), 10.1, 1e-9);
  EXPECT_NEAR(path.ToMap(end_ns, At(12.0)).position.x(), 11.0, 1e-9);
}

// Whoever follows the changes, one by one, is where the last correction alone would have put him.
TEST(RobotPath, ChangesAddUpToTheLastCorrection) {
  RobotPath path;
  for (int i = 0; i <= 100; ++i) Add(i * 100 * kMs, At(0.1 * i), &path);
  const auto correction = [](TimeNs end_ns, double given_m, double shift_m) {
    Pose3d moved = At(given_m);
    moved.position.y() = shift_m;
    moved.orientation = Turned(0.1 * shift_m).orientation;
    return TrajectoryChange({0, end_ns}, {At(0.0), At(given_m)}, {At(0.0), moved});
  };
  const auto follow = [&path](const TrajectoryChange& map_T_odom) {
    TrajectoryChange change = path.ChangeTo(map_T_odom);
    path.Correct(map_T_odom);
    return change;
  };
  const TrajectoryChange first = follow(correction(5'000 * kMs, 5.0, 0.4));
  const TrajectoryChange second = follow(correction(10'000 * kMs, 10.0, -0.6));
  for (TimeNs t = 0; t <= 10'000 * kMs; t += 500 * kMs) {
    Pose3d given;
    Pose3d now;
    ASSERT_EQ(path.GivenAt(t, &given), Answer::kKnown);
    ASSERT_EQ(path.At(t, &now), Answer::kKnown);
    const Pose3d followed = second.At(t) * (first.At(t) * given);
    EXPECT_LT((followed.position - now.position).norm(), 1e-3) << t;
    EXPECT_LT(AngleBetween(followed.orientation, now.orientation), 1e-3) << t;
  }
  const TrajectoryChange back = follow({});
  EXPECT_FALSE(back.IsIdentity());
  EXPECT_FALSE(path.is_corrected());
  EXPECT_TRUE(path.ChangeTo({}).IsIdentity());
}

}  // namespace
}  // namespace dsg::ingest
