// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pairwise.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "ingest/loop/believed_paths.h"
#include "ingest/loop/chi_square.h"
#include "ingest/loop/odometry_tree.h"
#include "ingest/loop/relative_covariance.h"
#include "ingest/loop/twist.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

Pose3d RandomPose(Random* random, double turn_rad) {
  const Eigen::Vector3d axis(random->Normal(), random->Normal(), random->Normal());
  return {Eigen::Vector3d(random->Normal(), random->Normal(), random->Normal()),
          Eigen::Quaterniond(
              Eigen::AngleAxisd(random->Uniform(-turn_rad, turn_rad), axis.normalized()))};
}

RelativePose CoarseEdge(int from, int to, const Pose3d& from_T_to, bool is_loop) {
  RelativePose edge;
  edge.from = from;
  edge.to = to;
  edge.from_T_to = from_T_to;
  edge.information.diagonal() << 400.0, 400.0, 400.0, 10000.0, 10000.0, 10000.0;
  edge.is_loop = is_loop;
  return edge;
}

// Out and back along a corridor: pose i and pose 2 n - 1 - i are at the same place.
PoseGraph OutAndBack(int half_count) {
  PoseGraph graph;
  for (int i = 0; i < 2 * half_count; ++i) {
    const bool is_back = i >= half_count;
    const int x = is_back ? 2 * half_count - 1 - i : i;
    graph.ids.push_back(i);
    graph.poses.push_back(Planar(x, 0.0, is_back ? std::numbers::pi : 0.0));
  }
  for (int i = 0; i + 1 < 2 * half_count; ++i) {
    const size_t k = static_cast<size_t>(i);
    graph.edges.push_back(
        CoarseEdge(i, i + 1, graph.poses[k].Inverse() * graph.poses[k + 1], false));
  }
  return graph;
}

TEST(Twist, MovesBetweenFramesAsItsPoseDoes) {
  Random random(1, 0);
  for (int round = 0; round < 100; ++round) {
    const Pose3d a_T_b = RandomPose(&random, 3.0);
    const Pose3d small = RandomPose(&random, 2.0);
    const Vector6d moved = LogOf(a_T_b * small * a_T_b.Inverse());
    EXPECT_LT((moved - AdjointOf(a_T_b) * LogOf(small)).norm(), 1e-9);
  }
}

TEST(Twist, IsTheRotationVectorAndThePositionWhenSmall) {
  const Pose3d small{Eigen::Vector3d(1e-5, 2e-5, -3e-5),
                     Eigen::Quaterniond(Eigen::AngleAxisd(1e-5, Eigen::Vector3d::UnitY()))};
  const Vector6d twist = LogOf(small);
  EXPECT_NEAR((twist.head<3>() - small.position).norm(), 0.0, 1e-9);
  EXPECT_NEAR((twist.tail<3>() - Eigen::Vector3d(0.0, 1e-5, 0.0)).norm(), 0.0, 1e-12);
}

TEST(ChiSquareGate, IsTheTabulatedQuantile) {
  EXPECT_NEAR(ChiSquareGate(0.99, true), 11.345, 1e-3);
  EXPECT_NEAR(ChiSquareGate(0.99, false), 16.812, 1e-3);
  EXPECT_NEAR(ChiSquareGate(0.95, true), 7.815, 1e-3);
}

TEST(OdometryTree, AddsCovariancesAlongTheWayWhicheverWayItIsWalked) {
  Random random(2, 0);
  PoseGraph graph;
  const int count = 40;
  for (int i = 0; i < count; ++i) graph.ids.push_back(i);
  graph.poses.resize(count);
  // A random tree, edges in both directions.
  std::vector<int> parents(count, -1);
  for (int i = 1; i < count; ++i) {
    const int parent = random.Index(i);
    parents[static_cast<size_t>(i)] = parent;
    const Pose3d step = RandomPose(&random, 2.0);
    graph.edges.push_back(random.Chance(0.5) ? CoarseEdge(parent, i, step, false)
                                             : CoarseEdge(i, parent, step, false));
  }
  const OdometryTree tree(graph);
  for (size_t i = 0; i < graph.poses.size(); ++i) {
    graph.poses[i] = tree.part_T_pose(static_cast<int>(i));
  }
  for (const RelativePose& edge : graph.edges) {
    const Pose3d rest = edge.from_T_to.Inverse() * tree.part_T_pose(edge.from).Inverse() *
                        tree.part_T_pose(edge.to);
    EXPECT_LT(LogOf(rest).norm(), 1e-9);
  }
  // The paths of a tree are the only ones, so that both ways to find them must agree.
  const BelievedPaths paths(graph, graph.poses, std::vector<bool>(graph.edges.size(), true));
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < count; ++b) {
      const Matrix6d wanted = *paths.CovariancesFrom(a, {b}).front();
      EXPECT_LT((tree.CovarianceBetween(a, b) - wanted).norm(), 1e-9 * (1.0 + wanted.norm()));
      EXPECT_NEAR(tree.RotationVarianceBetween(a, b), wanted.bottomRightCorner(3, 3).trace(), 1e-9);
    }
  }
}

TEST(OdometryTree, NumbersPartsThatHangApart) {
  PoseGraph graph = OutAndBack(4);
  graph.edges.erase(graph.edges.begin() + 3);
  const OdometryTree tree(graph);
  EXPECT_EQ(tree.part(3), 0);
  EXPECT_EQ(tree.part(4), 1);
  EXPECT_LT(tree.part_T_pose(4).position.norm(), 1e-12);
}

TEST(RelativeCovariances, AreThoseOfTheOnlyPathAndHalveOnTwoLikeIt) {
  for (const bool is_planar : {false, true}) {
    PoseGraph graph = OutAndBack(4);
    graph.is_planar = is_planar;
    const OdometryTree tree(graph);
    const std::vector<bool> all(2 * graph.edges.size(), true);
    RelativeCovariances single(graph, graph.poses, all);
    const Matrix6d wanted = tree.CovarianceBetween(1, 6);
    const Matrix6d found = *single.Between(1, 6);
    EXPECT_LT((found - wanted).norm(), 1e-9 * wanted.norm());
    const std::vector<RelativePose> edges = graph.edges;
    graph.edges.insert(graph.edges.end(), edges.begin(), edges.end());
    RelativeCovariances twice(graph, graph.poses, all);
    EXPECT_LT((*twice.Between(1, 6) - 0.5 * wanted).norm(), 1e-9 * wanted.norm());
    const std::optional<Matrix6d> without = WithoutEdge(0.5 * wanted, wanted, is_planar);
    ASSERT_TRUE(without.has_value());
    EXPECT_LT((*without - wanted).norm(), 1e-9 * wanted.norm());
  }
}

TEST(RelativeCovariances, SayNothingAcrossAGap) {
  PoseGraph graph = OutAndBack(4);
  graph.edges.erase(graph.edges.begin() + 3);
  const std::vector<bool> all(graph.edges.size(), true);
  RelativeCovariances covariances(graph, graph.poses, all);
  EXPECT_FALSE(covariances.Between(0, 7).has_value());
  EXPECT_TRUE(covariances.Between(4, 7).has_value());
}

TEST(BelievedPaths, SaysNothingOfPosesThatNoPathReaches) {
  PoseGraph graph = OutAndBack(4);
  std::vector<bool> is_believed(graph.edges.size(), true);
  is_believed[3] = false;
  const BelievedPaths torn(graph, graph.poses, is_believed);
  EXPECT_FALSE(torn.CovariancesFrom(0, {7}).front().has_value());
  EXPECT_TRUE(torn.CovariancesFrom(0, {3}).front().has_value());
}

// Loops in either direction, and between parts, say the same.
TEST(CompareLoops, FindsTheLiarAmongLoopsInEitherDirection) {
  for (const bool is_torn : {false, true}) {
    PoseGraph graph = OutAndBack(10);
    if (is_torn) graph.edges.erase(graph.edges.begin() + 9);
    for (const int i : {1, 3, 5, 7}) {
      const int j = 19 - i;
      const Pose3d i_T_j = Planar(0.0, 0.0, std::numbers::pi);
      graph.edges.push_back(i % 4 == 1 ? CoarseEdge(i, j, i_T_j, true)
                                       : CoarseEdge(j, i, i_T_j.Inverse(), true));
    }
    graph.edges.push_back(CoarseEdge(4, 15, Planar(4.0, 1.0, 0.5), true));
    PairwiseOptions options;
    const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
    ASSERT_EQ(agreement.edges.size(), 5u);
    for (int a = 0; a < 5; ++a) {
      for (int b = 0; b < a; ++b) {
        EXPECT_EQ(agreement.agrees.HasEdge(a, b), a != 4) << a << " " << b << " " << is_torn;
      }
      EXPECT_EQ(agreement.agrees_with_odometry[static_cast<size_t>(a)], a != 4 || is_torn);
    }
    EXPECT_TRUE(std::isinf(agreement.accident_count[4]));
    EXPECT_LT(agreement.accident_count[0], 1e-2);
  }
}

// The drift of the odometry between them is what the gate must allow for.
TEST(CompareLoops, PassesRightLoopsOfNoisyOdometryAsOftenAsItShould) {
  Random random(3, 0);
  int pair_count = 0;
  int agreed_count = 0;
  for (int round = 0; round < 300; ++round) {
    PoseGraph graph = OutAndBack(12);
    const std::vector<Pose3d> poses = graph.poses;
    for (const int i : {2, 9}) {
      graph.edges.push_back(CoarseEdge(i, 23 - i, Planar(0.0, 0.0, std::numbers::pi), true));
    }
    for (RelativePose& edge : graph.edges) {
      Eigen::Vector3d turn;
      Eigen::Vector3d shift;
      for (int i = 0; i < 3; ++i) {
        shift(i) = random.Normal() / 20.0;
        turn(i) = random.Normal() / 100.0;
      }
      edge.from_T_to =
          edge.from_T_to *
          Pose3d{shift, Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()))};
    }
    PairwiseOptions options;
    options.gate = ChiSquareGate(0.9, false);
    const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
    ++pair_count;
    agreed_count += agreement.agrees.HasEdge(0, 1) ? 1 : 0;
  }
  // Three standard deviations of the count.
  EXPECT_NEAR(agreed_count, 0.9 * pair_count, 3.0 * std::sqrt(0.09 * pair_count));
}

TEST(CompareLoops, ComparesTheNearestPairsWhenThereAreTooMany) {
  PoseGraph graph = OutAndBack(30);
  for (int i = 0; i < 28; ++i) {
    graph.edges.push_back(
        CoarseEdge(i, 59 - i, Planar(i % 2 == 0 ? 0.0 : 3.0, 0.0, std::numbers::pi), true));
  }
  PairwiseOptions options;
  options.pair_count_max = 60;
  const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
  for (int i = 0; i + 1 < 28; ++i) EXPECT_FALSE(agreement.agrees.HasEdge(i, i + 1)) << i;
  EXPECT_TRUE(agreement.agrees.HasEdge(0, 27));
}

}  // namespace
}  // namespace dsg::ingest
