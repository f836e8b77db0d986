// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/path_doubt.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

Pose3d Upright(const Vector3d& position, double heading_rad) {
  return {position, Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Vector3d::UnitZ()))};
}

TEST(PathDoubt, IsNothingAtFirst) {
  EXPECT_EQ(PathDoubt().At(Upright({1, 2, 3}, 0.4)), Matrix6d::Zero());
}

TEST(PathDoubt, OfTheHeadingGrowsWithTheDistanceFromItsPlace) {
  PathDoubt doubt;
  doubt.Add({5, 7, 1}, 0.3, 0.1);
  const Matrix6d there = doubt.At(Upright({5, 7, 1}, 2.0));
  EXPECT_NEAR(there(0, 0), 0.09, 1e-9);
  EXPECT_NEAR(there(1, 1), 0.09, 1e-9);
  EXPECT_NEAR(there(0, 1), 0.0, 1e-9);
  EXPECT_NEAR(there(5, 5), 0.01, 1e-12);
  EXPECT_NEAR(there(3, 3), 0.0, 1e-12);
  // Ten metres along x: sideways by a metre.
  const Matrix6d later = doubt.At(Upright({15, 7, 1}, -1.0));
  EXPECT_NEAR(later(0, 0), 0.09, 1e-9);
  EXPECT_NEAR(later(1, 1), 0.09 + 1.0, 1e-9);
  EXPECT_NEAR(later(2, 2), 0.09, 1e-9);
  EXPECT_NEAR(later(1, 5), 0.1, 1e-9);
}

TEST(PathDoubt, TurnsOnTheRightOfABodyThatLies) {
  PathDoubt doubt;
  doubt.Add(Vector3d::Zero(), 0.0, 0.2);
  const Pose3d lying{Vector3d::Zero(),
                     Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX()))};
  // The body's y axis points up.
  EXPECT_NEAR(doubt.At(lying)(4, 4), 0.04, 1e-12);
  EXPECT_NEAR(doubt.At(lying)(5, 5), 0.0, 1e-12);
}

TEST(PathDoubt, AddsUp) {
  PathDoubt doubt;
  doubt.Add({0, 0, 0}, 1.0, 0.0);
  doubt.Add({50, 0, 0}, 2.0, 0.0);
  EXPECT_NEAR(doubt.At(Upright({20, 0, 0}, 0.0))(0, 0), 5.0, 1e-9);
}

}  // namespace
}  // namespace dsg::ingest
