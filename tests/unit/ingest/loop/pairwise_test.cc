// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pairwise.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/loop/believed_paths.h"
#include "ingest/loop/chi_square.h"
#include "ingest/loop/loop_support.h"
#include "ingest/loop/odometry_tree.h"
#include "ingest/loop/relative_covariance.h"
#include "ingest/loop/twist.h"
#include "schema/base/random.h"
#include "schema/matching/max_clique.h"
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
        EXPECT_EQ(agreement.Agree(a, b), a != 4) << a << " " << b << " " << is_torn;
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
    agreed_count += agreement.Agree(0, 1) ? 1 : 0;
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
  options.evidence.pair_count_max = 60;
  const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
  for (int i = 0; i + 1 < 28; ++i) EXPECT_FALSE(agreement.Agree(i, i + 1)) << i;
  EXPECT_TRUE(agreement.Agree(0, 27));
  EXPECT_LE(agreement.compared_count, 60);
}

// Odometry of a tree, in parts, with branches; loops anywhere.
PoseGraph RandomTrees(int pose_count, int loop_count, Random* random) {
  PoseGraph graph;
  for (int i = 0; i < pose_count; ++i) {
    graph.ids.push_back(i);
    graph.poses.push_back(RandomPose(random, 1.0));
    if (i == 0 || random->Chance(0.03)) continue;
    const int parent = random->Chance(0.9) ? i - 1 : random->Index(i);
    graph.edges.push_back(CoarseEdge(parent, i, RandomPose(random, 0.3), false));
    graph.edges.back().information *= random->Uniform(0.1, 10.0);
  }
  while (loop_count > 0) {
    const int from = random->Index(pose_count);
    const int to = random->Index(pose_count);
    if (from == to) continue;
    graph.edges.push_back(CoarseEdge(from, to, RandomPose(random, 3.0), true));
    --loop_count;
  }
  return graph;
}

// As CompareLoops turns loops, and what it calls the variance of their cycle; negative without one.
double CycleVarianceOf(const OdometryTree& tree, RelativePose a, RelativePose b) {
  for (RelativePose* loop : {&a, &b}) {
    const std::pair from(tree.part(loop->from), loop->from);
    const std::pair to(tree.part(loop->to), loop->to);
    if (to < from) std::swap(loop->from, loop->to);
  }
  if (tree.part(a.from) != tree.part(b.from) || tree.part(a.to) != tree.part(b.to)) return -1.0;
  return tree.RotationVarianceBetween(a.from, b.from) + tree.RotationVarianceBetween(a.to, b.to);
}

// Looking at all pairs finds no others than the search among sorted ones.
TEST(CompareLoops, FindsTheNearestPairsOfAnyOdometry) {
  Random random(7, 0);
  for (int round = 0; round < 20; ++round) {
    const PoseGraph graph = RandomTrees(60, 80, &random);
    const OdometryTree tree(graph);
    PairwiseOptions options;
    // Every cycle may make a disagreement, and random loops hardly ever agree.
    options.evidence.turn_rad_max = 3.0;
    const LoopAgreement all = CompareLoops(graph, tree, options);
    options.evidence.pair_count_max = 40 + 30 * round;
    const LoopAgreement some = CompareLoops(graph, tree, options);
    EXPECT_LE(some.compared_count, options.evidence.pair_count_max);
    std::vector<double> variances;
    for (size_t a = 0; a < all.edges.size(); ++a) {
      for (size_t b = 0; b < a; ++b) {
        const double variance = CycleVarianceOf(tree, graph.edges[Index(all.edges[a])],
                                                graph.edges[Index(all.edges[b])]);
        if (variance >= 0.0) variances.push_back(variance);
      }
    }
    std::sort(variances.begin(), variances.end());
    ASSERT_LE(some.compared_count, std::ssize(variances));
    const double last =
        some.compared_count == 0 ? -1.0 : variances[static_cast<size_t>(some.compared_count - 1)];
    std::vector<std::pair<int, int>> wanted;
    for (const auto& [a, b] : all.disagreements) {
      const double variance = CycleVarianceOf(tree, graph.edges[Index(all.edges[Index(a)])],
                                              graph.edges[Index(all.edges[Index(b)])]);
      if (variance <= last) wanted.emplace_back(a, b);
    }
    EXPECT_EQ(some.disagreements, wanted) << round;
    EXPECT_GT(some.disagreements.size(), 10u) << round;
  }
}

TEST(CompareLoops, ComparesNoMoreThanIsAllowedWhereOdometryTellsNothing) {
  PoseGraph graph = OutAndBack(10);
  for (int i = 0; i < 40; ++i) {
    graph.edges.push_back(CoarseEdge(3, 16, Planar(0.1 * i, 0.0, std::numbers::pi), true));
  }
  PairwiseOptions options;
  options.evidence.pair_count_max = 100;
  EXPECT_EQ(CompareLoops(graph, OdometryTree(graph), options).compared_count, 100);
}

TEST(CompareLoops, TellsHowFarItIs) {
  Random random(8, 0);
  const PoseGraph graph = RandomTrees(60, 100, &random);
  PairwiseOptions options;
  std::vector<int64_t> told;
  options.on_work = [&told](const char* what, int64_t done, int64_t total) {
    EXPECT_STREQ(what, "comparing pairs of loop closures");
    EXPECT_LE(done, total);
    told.push_back(done);
  };
  const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
  EXPECT_EQ(std::ssize(told), (agreement.compared_count + 1023) / 1024);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
}

// Groups that disagree among themselves only are searched one by one.
TEST(ConsistentEdges, AreAsManyAsInASearchOfAllTogether) {
  Random random(9, 0);
  const double gate = ChiSquareGate(0.99, false);
  int largest = 0;
  for (int round = 0; round < 20; ++round) {
    PoseGraph graph = OutAndBack(30);
    for (int i = 0; i < 28; ++i) {
      // A third lies, each by one of two lies.
      const double lie = random.Chance(0.33) ? random.Chance(0.5) ? 1.0 : 2.0 : 0.0;
      graph.edges.push_back(CoarseEdge(i, 59 - i, Planar(lie, 0.0, std::numbers::pi), true));
    }
    PairwiseOptions options;
    options.gate = gate;
    const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
    BitsetGraph agrees(28);
    std::vector<int> fits;
    for (int a = 0; a < 28; ++a) {
      if (!agreement.agrees_with_odometry[Index(a)]) continue;
      for (const int b : fits) {
        if (agreement.Agree(a, b)) agrees.AddEdge(a, b);
      }
      fits.push_back(a);
    }
    const std::vector<bool> is_kept = ConsistentEdges(graph, gate);
    const auto kept_count = std::count(is_kept.begin() + 59, is_kept.end(), true);
    EXPECT_EQ(kept_count, std::ssize(FindMaxClique(agrees, {}).vertices)) << round;
    largest = std::max(largest, static_cast<int>(kept_count));
  }
  EXPECT_LT(largest, 28);
}

}  // namespace
}  // namespace dsg::ingest
