// SPDX-License-Identifier: Apache-2.0
#include "ingest/solver/pose_block.h"

#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <array>

#include "schema/base/random.h"
#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

using Block = std::array<double, kPoseBlockSize>;

Vector6d RandomStep(double range_m, double range_rad, Random* random) {
  Vector6d step;
  for (int i = 0; i < 6; ++i) {
    const double range = i < 3 ? range_m : range_rad;
    step[i] = random->Uniform(-range, range);
  }
  return step;
}

Pose3d AnyPose(Random* random) { return Stepped(Pose3d(), RandomStep(10.0, 1.7, random)); }

Block BlockOf(const Pose3d& pose) {
  Block block;
  WritePoseBlock(pose, block.data());
  return block;
}

TEST(PoseBlock, KeepsThePose) {
  Random random(test::TestSeed(1), 0);
  const Pose3d pose = AnyPose(&random);
  const Block block = BlockOf(pose);
  EXPECT_EQ(block[1], pose.position.y());
  EXPECT_EQ(block[3], pose.orientation.x());
  EXPECT_EQ(block[6], pose.orientation.w());
  EXPECT_EQ(PoseOfBlock(block.data()).position, pose.position);
  EXPECT_EQ(PoseOfBlock(block.data()).orientation.coeffs(), pose.orientation.coeffs());
}

TEST(PoseBlock, StepsInTheMapAndTurnsInTheBody) {
  const Pose3d turned{{1.0, 2.0, 3.0}, RotationOf({0.0, 0.0, 0.5 * M_PI})};
  Vector6d step;
  step << 1.0, 0.0, 0.0, 0.3, 0.0, 0.0;
  const Pose3d moved = Stepped(turned, step);
  EXPECT_LT((moved.position - Eigen::Vector3d(2.0, 2.0, 3.0)).norm(), 1e-15);
  // Rolled about its own x axis, which is the map's y axis.
  EXPECT_LT(AngleBetween(moved.orientation, RotationOf({0.0, 0.3, 0.0}) * turned.orientation),
            1e-15);
}

TEST(PoseBlock, ManifoldTakesBackWhatItAdds) {
  const std::unique_ptr<ceres::Manifold> manifold = MakePoseManifold();
  ASSERT_EQ(manifold->AmbientSize(), 7);
  ASSERT_EQ(manifold->TangentSize(), 6);
  Random random(test::TestSeed(2), 0);
  for (int round = 0; round < 100; ++round) {
    const Block x = BlockOf(AnyPose(&random));
    const Vector6d step = RandomStep(5.0, 1.7, &random);
    Block y{};
    ASSERT_TRUE(manifold->Plus(x.data(), step.data(), y.data()));
    EXPECT_NEAR(PoseOfBlock(y.data()).orientation.norm(), 1.0, 1e-15);
    Vector6d back;
    ASSERT_TRUE(manifold->Minus(y.data(), x.data(), back.data()));
    EXPECT_LT((back - step).norm(), 1e-12) << round;
  }
}

// Ceres multiplies a cost function's seven columns by this; the first six are the derivative.
TEST(PoseBlock, ManifoldPassesTheFirstSixColumnsOn) {
  const std::unique_ptr<ceres::Manifold> manifold = MakePoseManifold();
  Random random(test::TestSeed(3), 0);
  const Block x = BlockOf(AnyPose(&random));
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
  ASSERT_TRUE(manifold->PlusJacobian(x.data(), plus.data()));
  Eigen::Matrix<double, 1, 7> row;
  row << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0;
  const Eigen::Matrix<double, 1, 6> by_step = row * plus;
  for (int i = 0; i < 6; ++i) EXPECT_EQ(by_step[i], row[i]);
}

}  // namespace
}  // namespace dsg::ingest
