// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/trajectory_change.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

Pose3d RobotPose(double x, double y, double yaw_rad) {
  Pose3d pose;
  pose.position = {x, y, 1.0};
  pose.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

TEST(TrajectoryChange, TurnsAroundTheRobotBetweenKeyframes) {
  // Far from the origin, where interpolated transforms would swing things aside.
  const std::vector<Pose3d> before = {RobotPose(1000.0, 0.0, 0.0), RobotPose(1001.0, 0.0, 0.0)};
  const std::vector<Pose3d> after = {RobotPose(1000.0, 0.0, 0.0), RobotPose(1001.0, 0.0, 0.4)};
  const TrajectoryChange change({0, 1000}, before, after);
  const Eigen::Vector3d robot(1000.5, 0.0, 1.0);
  EXPECT_LT((change.At(500) * robot - robot).norm(), 1e-9);
  EXPECT_NEAR(AngleBetween(change.At(500).orientation, Eigen::Quaterniond::Identity()), 0.2, 1e-9);
}

TEST(TrajectoryChange, HoldsAtItsEndsAndIsIdentityWithoutKeyframes) {
  const TrajectoryChange change({10, 20}, {RobotPose(1.0, 0.0, 0.0), RobotPose(3.0, 0.0, 0.0)});
  EXPECT_EQ(change.At(0).position.x(), 1.0);
  EXPECT_EQ(change.At(15).position.x(), 2.0);
  EXPECT_EQ(change.At(99).position.x(), 3.0);
  EXPECT_EQ(TrajectoryChange().At(5).position, Eigen::Vector3d::Zero());
  EXPECT_TRUE(TrajectoryChange().IsIdentity());
}

// Each of both passes says where a wall is; their mean stands.
TEST(TrajectoryChange, MovesWhatWasSeenTwiceHalfway) {
  const TrajectoryChange change({0, 100}, {RobotPose(1.0, 0.0, 0.0), RobotPose(3.0, 0.0, 0.0)});
  const Pose3d thing = RobotPose(5.0, 2.0, 0.0);
  EXPECT_NEAR(MovePose(thing, 0, 100, change).position.x(), 7.0, 1e-12);
  EXPECT_NEAR(MovePose(thing, 0, 0, change).position.x(), 6.0, 1e-12);
  const Pose3d move = MoveOf(thing.position, 0, 100, change);
  EXPECT_NEAR((move * thing.position).x(), 7.0, 1e-12);
}

}  // namespace
}  // namespace dsg::ingest
