// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/optimize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ingest/loop/residual.h"
#include "ingest/loop/start.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

constexpr PoseObjective kObjectives[] = {PoseObjective::kGeodesic, PoseObjective::kSeSync,
                                         PoseObjective::kQuaternion};

// All poses where the first one is: what a start must not depend on.
PoseGraph WithoutPoses(PoseGraph graph) {
  for (Pose3d& pose : graph.poses) pose = graph.poses[0];
  return graph;
}

TEST(ChordalStart, IsExactWithoutNoise) {
  Random random(test::TestSeed(21), 0);
  for (const bool is_planar : {false, true}) {
    const PoseGraph graph = RandomGraph({.is_planar = is_planar, .pose_count = 100}, &random);
    const std::vector<Pose3d> poses = ChordalStart(WithoutPoses(graph), {});
    EXPECT_LT(LargestDifference(poses, graph.poses), 1e-8);
  }
}

TEST(ChordalStart, LeavesPosesWithoutEdgesAlone) {
  Random random(test::TestSeed(22), 0);
  PoseGraph graph = RandomGraph({.pose_count = 10}, &random);
  std::vector<Pose3d> expected = graph.poses;
  graph = WithoutPoses(graph);
  graph.ids.push_back(99);
  graph.poses.push_back(RandomPose(false, 9.0, 1.0, &random));
  expected.push_back(graph.poses.back());
  EXPECT_LT(LargestDifference(ChordalStart(graph, {}), expected), 1e-8);
}

TEST(TreeStart, FollowsOdometryBeforeLoops) {
  Random random(test::TestSeed(23), 0);
  PoseGraph graph = RandomGraph({.pose_count = 50, .loop_count = 0}, &random);
  RelativePose lie = graph.edges[0];
  lie.to = 40;
  lie.is_loop = true;
  graph.edges.insert(graph.edges.begin(), lie);
  const std::vector<Pose3d> poses = TreeStart(WithoutPoses(graph), {}, {0});
  EXPECT_LT(LargestDifference(poses, graph.poses), 1e-9);
}

TEST(Parts, AreNumberedByTheirFirstPose) {
  PoseGraph graph;
  graph.poses.resize(6);
  graph.edges.resize(3);
  graph.edges[0].from = 4;
  graph.edges[0].to = 1;
  graph.edges[1].from = 5;
  graph.edges[1].to = 3;
  graph.edges[2].from = 3;
  graph.edges[2].to = 0;
  EXPECT_EQ(PartsOf(graph, {}), (std::vector<int>{0, 1, 2, 0, 1, 0}));
  EXPECT_EQ(PartsOf(graph, {1.0, 1.0, 0.0}), (std::vector<int>{0, 1, 2, 3, 1, 3}));
  EXPECT_EQ(AnchorsOf({0, 1, 2, 0, 1, 0}, 4), (std::vector<int>{0, 4, 2}));
}

TEST(Optimize, FindsTheTruthWithoutNoise) {
  Random random(test::TestSeed(24), 0);
  for (const bool is_planar : {false, true}) {
    const PoseGraph graph = RandomGraph({.is_planar = is_planar}, &random);
    PoseGraph shaken = graph;
    for (size_t i = 1; i < graph.poses.size(); ++i) {
      shaken.poses[i] = graph.poses[i] * RandomPose(is_planar, 0.2, 0.2, &random);
    }
    for (const PoseObjective objective : kObjectives) {
      OptimizeOptions options{.objective = objective, .is_chordal_start = false};
      const auto optimized = Optimize(shaken, options);
      ASSERT_TRUE(optimized.ok()) << optimized.status();
      EXPECT_TRUE(optimized->is_converged);
      EXPECT_GT(optimized->start_cost, 1.0);
      EXPECT_LT(optimized->cost, 1e-12);
      EXPECT_LT(LargestDifference(optimized->poses, graph.poses), 1e-6);
    }
  }
}

// At a minimum no pose can be moved for the better.
TEST(Optimize, EndsWhereTheCostHasNoSlope) {
  Random random(test::TestSeed(25), 0);
  for (const bool is_planar : {false, true}) {
    const PoseGraph graph =
        RandomGraph({.is_planar = is_planar, .noise_m = 0.1, .noise_rad = 0.1}, &random);
    for (const PoseObjective objective : kObjectives) {
      const auto optimized = Optimize(graph, {.objective = objective, .tolerance = 1e-14});
      ASSERT_TRUE(optimized.ok()) << optimized.status();
      EXPECT_LT(optimized->cost, CostOf(graph, graph.poses, {}, objective));
      for (size_t i = 1; i < graph.poses.size(); ++i) {
        for (int round = 0; round < 4; ++round) {
          std::vector<Pose3d> poses = optimized->poses;
          poses[i] = poses[i] * RandomPose(is_planar, 1e-3, 1e-3, &random);
          EXPECT_GE(CostOf(graph, poses, {}, objective), optimized->cost);
        }
      }
    }
  }
}

TEST(Optimize, PlanarGraphsGiveWhatTheSameGraphInSpaceGives) {
  Random random(test::TestSeed(26), 0);
  PoseGraph graph = RandomGraph({.is_planar = true, .noise_m = 0.1, .noise_rad = 0.1}, &random);
  const auto planar = Optimize(graph, {.tolerance = 1e-14});
  graph.is_planar = false;
  const auto spatial = Optimize(graph, {.tolerance = 1e-14});
  ASSERT_TRUE(planar.ok() && spatial.ok());
  EXPECT_NEAR(planar->cost, spatial->cost, 1e-9 * planar->cost);
  EXPECT_LT(LargestDifference(planar->poses, spatial->poses), 1e-5);
}

TEST(Optimize, LeavesTheFixedPoseWhereItIs) {
  Random random(test::TestSeed(27), 0);
  const PoseGraph graph = RandomGraph({.noise_m = 0.1, .noise_rad = 0.1}, &random);
  const auto at_first = Optimize(graph, {});
  const auto at_seventh = Optimize(graph, {.fixed_pose = 7});
  ASSERT_TRUE(at_first.ok() && at_seventh.ok());
  EXPECT_EQ(LargestDifference({at_seventh->poses[7]}, {graph.poses[7]}), 0.0);
  EXPECT_EQ(LargestDifference({at_first->poses[0]}, {graph.poses[0]}), 0.0);
  EXPECT_NEAR(at_first->cost, at_seventh->cost, 1e-8 * at_first->cost);
}

TEST(Optimize, KeepsTheFirstPoseOfEachPart) {
  Random random(test::TestSeed(28), 0);
  const RandomGraphOptions options{.noise_m = 0.1, .noise_rad = 0.1};
  PoseGraph graph = RandomGraph(options, &random);
  const PoseGraph other = RandomGraph(options, &random);
  const int first_count = static_cast<int>(graph.poses.size());
  graph.poses.insert(graph.poses.end(), other.poses.begin(), other.poses.end());
  for (RelativePose edge : other.edges) {
    edge.from += first_count;
    edge.to += first_count;
    graph.edges.push_back(edge);
  }
  const auto both = Optimize(graph, {});
  const auto alone = Optimize(other, {});
  ASSERT_TRUE(both.ok() && alone.ok());
  const std::vector<Pose3d> second(both->poses.begin() + first_count, both->poses.end());
  EXPECT_EQ(LargestDifference({second[0]}, {other.poses[0]}), 0.0);
  EXPECT_LT(LargestDifference(second, alone->poses), 1e-4);
}

TEST(Optimize, TakesEdgesOfWeightZeroForAbsent) {
  Random random(test::TestSeed(29), 0);
  PoseGraph graph = RandomGraph({.noise_m = 0.1, .noise_rad = 0.1}, &random);
  const auto without = Optimize(graph, {});
  RelativePose lie = graph.edges[0];
  lie.to = 20;
  graph.edges.push_back(lie);
  std::vector<double> weights(graph.edges.size(), 1.0);
  weights.back() = 0.0;
  const auto weighted = Optimize(graph, {.weights = weights});
  const auto believed = Optimize(graph, {});
  ASSERT_TRUE(without.ok() && weighted.ok() && believed.ok());
  EXPECT_EQ(without->cost, weighted->cost);
  EXPECT_EQ(LargestDifference(without->poses, weighted->poses), 0.0);
  EXPECT_GT(believed->cost, without->cost);
}

TEST(Optimize, GivesTheSameBitsTwice) {
  Random random(test::TestSeed(30), 0);
  const PoseGraph graph = RandomGraph(
      {.pose_count = 200, .loop_count = 100, .noise_m = 0.1, .noise_rad = 0.1}, &random);
  const auto a = Optimize(graph, {.has_covariance = true});
  const auto b = Optimize(graph, {.has_covariance = true});
  ASSERT_TRUE(a.ok() && b.ok());
  for (size_t i = 0; i < a->poses.size(); ++i) {
    EXPECT_EQ(a->poses[i].position, b->poses[i].position);
    EXPECT_EQ(a->poses[i].orientation.coeffs(), b->poses[i].orientation.coeffs());
    EXPECT_EQ(a->covariances[i], b->covariances[i]);
  }
}

TEST(Optimize, TellsTheCostOfEachStep) {
  Random random(test::TestSeed(31), 0);
  const PoseGraph graph = RandomGraph({.noise_m = 0.2, .noise_rad = 0.2}, &random);
  OptimizeOptions options;
  std::vector<double> costs;
  options.on_iteration = [&costs](int iteration, double cost) {
    EXPECT_EQ(iteration, static_cast<int>(costs.size()));
    costs.push_back(cost);
  };
  const auto optimized = Optimize(graph, options);
  ASSERT_TRUE(optimized.ok());
  ASSERT_EQ(static_cast<int>(costs.size()), optimized->iteration_count + 1);
  EXPECT_NEAR(costs.front(), optimized->start_cost, 1e-9 * costs.front());
  EXPECT_NEAR(costs.back(), optimized->cost, 1e-9 * costs.front());
}

TEST(Optimize, StopsAfterAsManyStepsAsItMay) {
  Random random(test::TestSeed(32), 0);
  const PoseGraph graph = RandomGraph({.noise_m = 0.2, .noise_rad = 0.2}, &random);
  const auto optimized = Optimize(graph, {.iteration_count_max = 1});
  ASSERT_TRUE(optimized.ok());
  EXPECT_FALSE(optimized->is_converged);
  EXPECT_EQ(optimized->iteration_count, 1);
}

TEST(Optimize, HasNothingToDoWithoutEdges) {
  PoseGraph graph;
  ASSERT_TRUE(Optimize(graph, {}).ok());
  graph.poses.resize(3);
  const auto optimized = Optimize(graph, {.has_covariance = true});
  ASSERT_TRUE(optimized.ok()) << optimized.status();
  EXPECT_EQ(optimized->poses.size(), 3u);
  EXPECT_EQ(optimized->cost, 0.0);
  EXPECT_EQ(optimized->covariances, std::vector<Matrix6d>(3, Matrix6d::Zero()));
}

class BadGraph : public testing::Test {
 protected:
  void ExpectRefusal(const std::string& part) {
    const auto optimized = Optimize(graph_, options_);
    ASSERT_FALSE(optimized.ok());
    EXPECT_EQ(ReasonOf(optimized.status()), Reason::kFieldInvalid);
    EXPECT_NE(optimized.status().message().find(part), absl::string_view::npos)
        << optimized.status();
  }

  Random random_{33, 0};
  PoseGraph graph_ = RandomGraph({.pose_count = 5}, &random_);
  OptimizeOptions options_;
};

TEST_F(BadGraph, OfWeightsOfAnotherCountIsRefused) {
  options_.weights = {1.0};
  ExpectRefusal("1 weights for");
}

TEST_F(BadGraph, OfANegativeWeightIsRefused) {
  options_.weights.assign(graph_.edges.size(), 1.0);
  options_.weights[2] = -1.0;
  ExpectRefusal("weight 2 is -1");
}

TEST_F(BadGraph, OfAnEdgeToNowhereIsRefused) {
  graph_.edges[1].to = 5;
  graph_.edges[1].line = 17;
  ExpectRefusal("edge 1 (line 17)");
}

TEST_F(BadGraph, OfAnEdgeFromAPoseToItselfIsRefused) {
  graph_.edges[1].to = graph_.edges[1].from;
  ExpectRefusal("to itself");
}

TEST_F(BadGraph, OfANumberThatIsNoneIsRefused) {
  graph_.poses[3].position.x() = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal("pose 3");
}

TEST_F(BadGraph, OfIndefiniteInformationIsRefused) {
  graph_.edges[0].information(0, 0) = -1.0;
  ExpectRefusal("positive definite");
}

TEST_F(BadGraph, OfNumbersTooLargeToSquareIsRefused) {
  graph_.poses[3].position.x() = 1e200;
  options_.is_chordal_start = false;
  ExpectRefusal("too large");
}

TEST_F(BadGraph, OfAFixedPoseOutsideIsRefused) {
  options_.fixed_pose = 5;
  ExpectRefusal("fixed pose 5");
}

}  // namespace
}  // namespace dsg::ingest
