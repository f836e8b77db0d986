// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pose_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "ingest/loop/residual.h"
#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

TEST(DiagonalOfInverse, IsThatOfTheDenseInverse) {
  Random random(test::TestSeed(41), 0);
  for (int round = 0; round < 20; ++round) {
    const int block_count = random.Integer(1, 25);
    const int size = random.Integer(1, 6);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Identity(block_count * size, block_count * size);
    for (int pair = 0; pair < 2 * block_count; ++pair) {
      const int a = random.Index(block_count) * size;
      const int b = random.Index(block_count) * size;
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(size, dense.cols());
      for (int r = 0; r < size; ++r) {
        for (int c = 0; c < size; ++c) {
          rows(r, a + c) = random.Normal();
          rows(r, b + c) = random.Normal();
        }
      }
      dense += rows.transpose() * rows;
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (int r = 0; r < dense.rows(); ++r) {
      for (int c = 0; c <= r; ++c) {
        if (dense(r, c) != 0.0 || r / size == c / size) entries.emplace_back(r, c, dense(r, c));
      }
    }
    Eigen::SparseMatrix<double> sparse(dense.rows(), dense.cols());
    sparse.setFromTriplets(entries.begin(), entries.end());
    const Eigen::MatrixXd inverse = dense.inverse();
    const std::vector<Eigen::MatrixXd> blocks = DiagonalOfInverse(sparse, size);
    ASSERT_EQ(blocks.size(), static_cast<size_t>(block_count));
    for (int i = 0; i < block_count; ++i) {
      const Eigen::MatrixXd expected = inverse.block(i * size, i * size, size, size);
      EXPECT_LT((blocks[static_cast<size_t>(i)] - expected).norm(), 1e-10) << round;
    }
  }
}

TEST(DiagonalOfInverse, IsEmptyForASingularMatrix) {
  Eigen::SparseMatrix<double> zero(3, 3);
  for (int i = 0; i < 3; ++i) zero.insert(i, i) = 0.0;
  EXPECT_TRUE(DiagonalOfInverse(zero, 3).empty());
}

// Far from the first pose, its uncertain turn becomes an uncertain place.
TEST(Covariance, GrowsWithTheWayAlongOdometry) {
  PoseGraph graph;
  graph.poses = {Pose3d(), {Eigen::Vector3d(10.0, 0.0, 0.0)}, {Eigen::Vector3d(20.0, 0.0, 0.0)}};
  graph.ids = {0, 1, 2};
  for (const int i : {0, 1}) {
    RelativePose edge;
    edge.from = i;
    edge.to = i + 1;
    edge.from_T_to.position.x() = 10.0;
    edge.information.diagonal() << 1e4, 1e4, 1e4, 1e6, 1e6, 1e6;
    graph.edges.push_back(edge);
  }
  for (const bool is_planar : {false, true}) {
    graph.is_planar = is_planar;
    const auto optimized = Optimize(graph, {.has_covariance = true});
    ASSERT_TRUE(optimized.ok()) << optimized.status();
    EXPECT_EQ(optimized->covariances[0], Matrix6d::Zero());
    const Matrix6d& last = optimized->covariances[2];
    EXPECT_NEAR(last(0, 0), 2e-4, 1e-9);
    EXPECT_NEAR(last(1, 1), 2e-4 + 100.0 * 1e-6, 1e-9);
    EXPECT_NEAR(last(5, 5), 2e-6, 1e-12);
    EXPECT_NEAR(last(1, 5), 10.0 * 1e-6, 1e-11);
    EXPECT_NEAR(last(3, 3), is_planar ? 0.0 : 2e-6, 1e-12);
  }
}

// What the covariance promises is what noise does: measured again and again, solutions scatter so.
TEST(Covariance, IsTheScatterOfSolutions) {
  Random random(test::TestSeed(42), 0);
  const PoseGraph truth = RandomGraph({.pose_count = 8, .loop_count = 6}, &random);
  const auto expected = Optimize(truth, {.has_covariance = true});
  ASSERT_TRUE(expected.ok());
  constexpr double kScale = 0.01;
  constexpr int kRounds = 3000;
  Matrix6d scatter = Matrix6d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    PoseGraph noisy = truth;
    for (RelativePose& edge : noisy.edges) {
      Vector6d normal;
      for (double& value : normal) value = kScale * random.Normal();
      const Vector6d error = edge.information.llt().matrixU().solve(normal);
      // The residual's translation is in the axes of the measured pose.
      edge.from_T_to = edge.from_T_to * Pose3d{error.head<3>(), RotationOf(error.tail<3>())};
    }
    const auto optimized = Optimize(noisy, {.tolerance = 1e-6, .is_chordal_start = false});
    ASSERT_TRUE(optimized.ok());
    const Pose3d& was = truth.poses.back();
    const Pose3d& is = optimized->poses.back();
    Vector6d step;
    step.head<3>() = is.position - was.position;
    step.tail<3>() = SpatialResidual({}, {Eigen::Vector3d::Zero(), was.orientation},
                                     {Eigen::Vector3d::Zero(), is.orientation},
                                     RotationError::kVector, nullptr, nullptr)
                         .tail<3>();
    scatter += step * step.transpose() / (kRounds * kScale * kScale);
  }
  const Matrix6d& promised = expected->covariances.back();
  // Relative to the spread; 3000 draws leave 2.6 % on a variance.
  const Vector6d scale = promised.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d difference = scale.asDiagonal() * (scatter - promised) * scale.asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.15);
}

}  // namespace
}  // namespace dsg::ingest
