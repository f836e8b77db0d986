// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/residual.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

constexpr double kStep = 1e-6;

Pose3d Step(const Pose3d& pose, int row, double size) {
  Vector6d step = Vector6d::Zero();
  step[row] = size;
  return {pose.position + step.head<3>(), pose.orientation * RotationOf(step.tail<3>())};
}

TEST(Residual, SpatialDerivativesAgreeWithDifferences) {
  Random random(test::TestSeed(11), 0);
  for (int round = 0; round < 200; ++round) {
    const Pose3d z = RandomPose(false, 3.0, 1.5, &random);
    const Pose3d from = RandomPose(false, 3.0, 1.5, &random);
    const Pose3d to = round % 2 == 0 ? from * z * RandomPose(false, 0.1, 1e-5, &random)
                                     : RandomPose(false, 3.0, 1.5, &random);
    for (const RotationError error : {RotationError::kVector, RotationError::kTwiceSine}) {
      Matrix6d by_from;
      Matrix6d by_to;
      const Vector6d whole = SpatialResidual(z, from, to, error, &by_from, &by_to);
      // Turned by half a circle the residual jumps, and so do differences.
      if (whole.tail<3>().norm() > (error == RotationError::kVector ? 3.0 : 1.99)) continue;
      for (int row = 0; row < 6; ++row) {
        const auto at = [&](const Pose3d& a, const Pose3d& b) {
          return SpatialResidual(z, a, b, error, nullptr, nullptr);
        };
        const Vector6d from_change =
            (at(Step(from, row, kStep), to) - at(Step(from, row, -kStep), to)) / (2.0 * kStep);
        const Vector6d to_change =
            (at(from, Step(to, row, kStep)) - at(from, Step(to, row, -kStep))) / (2.0 * kStep);
        EXPECT_LT((by_from.col(row) - from_change).norm(), 1e-7) << round << " row " << row;
        EXPECT_LT((by_to.col(row) - to_change).norm(), 1e-7) << round << " row " << row;
      }
    }
  }
}

TEST(Residual, PlanarDerivativesAgreeWithDifferences) {
  Random random(test::TestSeed(12), 0);
  const auto draw = [&random] {
    return Eigen::Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-1, 1));
  };
  for (int round = 0; round < 200; ++round) {
    const Eigen::Vector3d z = draw();
    const Eigen::Vector3d from = draw();
    const Eigen::Vector3d to = draw();
    for (const RotationError error : {RotationError::kVector, RotationError::kTwiceSine}) {
      Eigen::Matrix3d by_from;
      Eigen::Matrix3d by_to;
      PlanarResidual(z, from, to, error, &by_from, &by_to);
      for (int row = 0; row < 3; ++row) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(row);
        const auto at = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
          return PlanarResidual(z, a, b, error, nullptr, nullptr);
        };
        const Eigen::Vector3d from_change =
            (at(from + step, to) - at(from - step, to)) / (2.0 * kStep);
        const Eigen::Vector3d to_change =
            (at(from, to + step) - at(from, to - step)) / (2.0 * kStep);
        EXPECT_LT((by_from.col(row) - from_change).norm(), 1e-7) << round << " row " << row;
        EXPECT_LT((by_to.col(row) - to_change).norm(), 1e-7) << round << " row " << row;
      }
    }
  }
}

TEST(Residual, RotationVectorsAreExactFromNothingToHalfACircle) {
  Random random(test::TestSeed(13), 0);
  for (const double angle : {0.0, 1e-12, 1e-5, 9.9e-5, 2.1e-4, 0.1, 1.0, 3.0, 3.1415926}) {
    const Eigen::Vector3d axis =
        Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const Pose3d turned{Eigen::Vector3d::Zero(), RotationOf(angle * axis)};
    const Vector6d residual =
        SpatialResidual({}, {}, turned, RotationError::kVector, nullptr, nullptr);
    EXPECT_LT((residual.tail<3>() - angle * axis).norm(), 1e-14 + 1e-13 * angle) << angle;
  }
}

TEST(Residual, IsZeroWhereThePosesAreAsMeasured) {
  Random random(test::TestSeed(14), 0);
  RelativePose edge;
  edge.from_T_to = RandomPose(false, 3.0, 1.5, &random);
  edge.information = RandomInformation(false, &random);
  const Pose3d from = RandomPose(false, 3.0, 1.5, &random);
  EXPECT_LT(SquaredResidual(edge, false, from, from * edge.from_T_to), 1e-20);
}

TEST(Residual, PlanarAnglesAreTakenTheShortWay) {
  RelativePose edge;
  edge.from_T_to = FromPlanar({0.0, 0.0, 3.1}, 0.0);
  const Pose3d from = FromPlanar({0.0, 0.0, 3.0}, 0.0);
  const Pose3d to = FromPlanar({0.0, 0.0, 3.0 + 3.1 + 0.01}, 0.0);
  EXPECT_NEAR(SquaredResidual(edge, true, from, to), 1e-4, 1e-12);
}

// Written from the paper's formula with matrices, which the solver does not use.
TEST(SeSync, CostIsThePapersSumOverMatrices) {
  Random random(test::TestSeed(15), 0);
  for (const bool is_planar : {false, true}) {
    const PoseGraph graph =
        RandomGraph({.is_planar = is_planar, .noise_m = 0.3, .noise_rad = 0.3}, &random);
    double sum = 0.0;
    for (const RelativePose& edge : graph.edges) {
      const Pose3d& from = graph.poses[static_cast<size_t>(edge.from)];
      const Pose3d& to = graph.poses[static_cast<size_t>(edge.to)];
      const Eigen::Matrix3d from_R = from.orientation.toRotationMatrix();
      const Eigen::Matrix3d turn = to.orientation.toRotationMatrix() -
                                   from_R * edge.from_T_to.orientation.toRotationMatrix();
      const Eigen::Vector3d way = to.position - from.position - from_R * edge.from_T_to.position;
      const SeSyncWeights weights = WeightsOf(edge, is_planar);
      sum += weights.kappa * turn.squaredNorm() + weights.tau * way.squaredNorm();
    }
    EXPECT_NEAR(2.0 * CostOf(graph, graph.poses, {}, PoseObjective::kSeSync), sum, 1e-9 * sum);
  }
}

TEST(SeSync, WeightsAreThoseOfTheFilesCovariances) {
  RelativePose edge;
  Vector6d diagonal;
  diagonal << 1.0, 4.0, 2.0, 10.0, 5.0, 20.0;
  edge.information = diagonal.asDiagonal();
  const SeSyncWeights spatial = WeightsOf(edge, false);
  EXPECT_NEAR(spatial.tau, 3.0 / (1.0 + 0.25 + 0.5), 1e-12);
  EXPECT_NEAR(spatial.kappa, 3.0 / (2.0 * (0.1 + 0.2 + 0.05)), 1e-12);
  const SeSyncWeights planar = WeightsOf(edge, true);
  EXPECT_NEAR(planar.tau, 2.0 / (1.0 + 0.25), 1e-12);
  EXPECT_NEAR(planar.kappa, 20.0, 1e-12);
}

TEST(Cost, DoesNotChangeWhenEverythingMoves) {
  Random random(test::TestSeed(16), 0);
  for (const bool is_planar : {false, true}) {
    const PoseGraph graph =
        RandomGraph({.is_planar = is_planar, .noise_m = 0.3, .noise_rad = 0.3}, &random);
    const std::vector<Pose3d> moved =
        Moved(RandomPose(is_planar, 100.0, 1.5, &random), graph.poses);
    for (const PoseObjective objective :
         {PoseObjective::kGeodesic, PoseObjective::kSeSync, PoseObjective::kQuaternion}) {
      const double cost = CostOf(graph, graph.poses, {}, objective);
      EXPECT_NEAR(CostOf(graph, moved, {}, objective), cost, 1e-9 * cost);
    }
  }
}

TEST(Cost, CountsEachEdgeByItsWeight) {
  Random random(test::TestSeed(17), 0);
  const PoseGraph graph = RandomGraph({.noise_m = 0.3, .noise_rad = 0.3}, &random);
  std::vector<double> weights;
  double sum = 0.0;
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    weights.push_back(i % 3 == 0 ? 0.0 : random.Uniform());
    const RelativePose& edge = graph.edges[i];
    sum += 0.5 * weights.back() *
           SquaredResidual(edge, false, graph.poses[static_cast<size_t>(edge.from)],
                           graph.poses[static_cast<size_t>(edge.to)]);
  }
  EXPECT_NEAR(CostOf(graph, graph.poses, weights, PoseObjective::kGeodesic), sum, 1e-9 * sum);
}

TEST(Cost, OfQuaternionsIsAQuarterOfTheRotationsForSmallErrors) {
  RelativePose edge;
  PoseGraph graph;
  graph.edges.push_back(edge);
  graph.edges[0].to = 1;
  graph.poses = {Pose3d(), {Eigen::Vector3d::Zero(), RotationOf({0.0, 0.002, 0.0})}};
  EXPECT_NEAR(CostOf(graph, graph.poses, {}, PoseObjective::kGeodesic), 0.5 * 4e-6, 1e-18);
  EXPECT_NEAR(CostOf(graph, graph.poses, {}, PoseObjective::kQuaternion), 0.5 * 1e-6, 1e-12);
}

}  // namespace
}  // namespace dsg::ingest
