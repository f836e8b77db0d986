// SPDX-License-Identifier: Apache-2.0
#include "schema/model/geometry.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg {
namespace {

Pose3d Yawed(double x, double y, double yaw_rad) {
  return {{x, y, 0.0}, Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

TEST(Pose3d, InverseUndoesTheTransform) {
  const Pose3d pose = Yawed(1.0, 2.0, 0.7);
  const Eigen::Vector3d point(3.0, -1.0, 2.0);
  EXPECT_TRUE((pose.Inverse() * (pose * point)).isApprox(point, 1e-12));
  EXPECT_LT(((pose * pose.Inverse()).position).norm(), 1e-12);
}

TEST(Interpolate, GoesHalfWayInPositionAndAngle) {
  const Pose3d middle = Interpolate(Yawed(0, 0, 0.0), Yawed(2, 4, 1.0), 0.5);
  EXPECT_TRUE(middle.position.isApprox(Eigen::Vector3d(1, 2, 0)));
  EXPECT_NEAR(AngleBetween(middle.orientation, Yawed(0, 0, 0.5).orientation), 0.0, 1e-12);
}

TEST(Interpolate, TakesTheShorterArcWhenSignsDiffer) {
  Pose3d to = Yawed(0, 0, 0.2);
  to.orientation.coeffs() *= -1.0;
  const Pose3d middle = Interpolate(Yawed(0, 0, 0.0), to, 0.5);
  EXPECT_NEAR(AngleBetween(middle.orientation, Yawed(0, 0, 0.1).orientation), 0.0, 1e-12);
}

TEST(AngleBetween, IsAccurateForTinyTurns) {
  EXPECT_NEAR(AngleBetween(Yawed(0, 0, 0.0).orientation, Yawed(0, 0, 1e-9).orientation), 1e-9,
              1e-15);
}

TEST(IsValidPose, RefusesNanAndScaledQuaternions) {
  Pose3d pose;
  EXPECT_TRUE(IsValidPose(pose));
  pose.orientation.w() = 1.1;
  EXPECT_FALSE(IsValidPose(pose));
  pose = Pose3d();
  pose.position.x() = std::nan("");
  EXPECT_FALSE(IsValidPose(pose));
}

TEST(TransformBox, BoundsTheTurnedBox) {
  const Box3d box(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 2));
  const Box3d turned = TransformBox(Yawed(10, 0, M_PI / 4), box);
  EXPECT_NEAR(turned.min().x(), 10 - std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(turned.max().y(), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(turned.max().z(), 2.0, 1e-12);
  EXPECT_TRUE(TransformBox(Pose3d(), Box3d()).isEmpty());
}

TEST(DistanceToBox, IsZeroInside) {
  const Box3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(DistanceToBox({0.5, 0.5, 0.5}, box), 0.0);
  EXPECT_DOUBLE_EQ(DistanceToBox({4, 5, 1}, box), 5.0);
}

TEST(DistanceToBox, TurnsWithItsNode) {
  const Box3d box(Eigen::Vector3d(-2, -0.1, -1), Eigen::Vector3d(2, 0.1, 1));
  Pose3d map_T_node;
  map_T_node.position = {1, 1, 0};
  map_T_node.orientation = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ());
  // Across the long side: sqrt(2) from the middle plane, which is 0.1 m inside.
  EXPECT_NEAR(DistanceToBox({2, 0, 0}, map_T_node, box), std::sqrt(2.0) - 0.1, 1e-12);
  EXPECT_EQ(DistanceToBox({2, 2, 0}, map_T_node, box), 0.0);
  EXPECT_EQ(DistanceToBox({1, 1, 3}, map_T_node, Box3d()), 3.0);
}

TEST(Polygon, KnowsInsideFromOutsideOfAnLShape) {
  const Polygon2d shape = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 3}, {0, 3}};
  EXPECT_TRUE(PolygonContains(shape, {3.5, 0.5}));
  EXPECT_TRUE(PolygonContains(shape, {0.5, 2.5}));
  EXPECT_FALSE(PolygonContains(shape, {2.0, 2.0}));
  EXPECT_DOUBLE_EQ(SignedDistanceToPolygon(shape, {2.0, 2.0}), 1.0);
  EXPECT_DOUBLE_EQ(SignedDistanceToPolygon(shape, {2.0, 0.25}), -0.25);
}

}  // namespace
}  // namespace dsg
