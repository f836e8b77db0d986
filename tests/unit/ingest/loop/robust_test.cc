// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/robust.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "ingest/loop/belief.h"
#include "ingest/loop/graduated.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/loop/random_graph.h"
#include "tests/unit/ingest/loop/wrong_loops.h"

namespace dsg::ingest {
namespace {

RelativePose FineEdge(int from, int to, const Pose3d& from_T_to, bool is_loop) {
  RelativePose edge;
  edge.from = from;
  edge.to = to;
  edge.from_T_to = from_T_to;
  edge.information.diagonal() << 2500.0, 2500.0, 2500.0, 40000.0, 40000.0, 40000.0;
  edge.is_loop = is_loop;
  return edge;
}

Pose3d WithNoise(const Pose3d& pose, Random* random) {
  return pose * Planar(random->Normal() / 50.0, random->Normal() / 50.0, random->Normal() / 200.0);
}

// Poses in order, odometry between them, a loop for each pair; all measured with noise.
PoseGraph Measured(const std::vector<Pose3d>& poses, const std::vector<std::pair<int, int>>& loops,
                   bool is_planar, Random* random) {
  PoseGraph graph;
  graph.is_planar = is_planar;
  graph.poses = poses;
  for (size_t i = 0; i < poses.size(); ++i) graph.ids.push_back(static_cast<int64_t>(i));
  const auto add = [&](int from, int to, bool is_loop) {
    const Pose3d from_T_to =
        poses[static_cast<size_t>(from)].Inverse() * poses[static_cast<size_t>(to)];
    graph.edges.push_back(FineEdge(from, to, WithNoise(from_T_to, random), is_loop));
  };
  for (int i = 0; i + 1 < static_cast<int>(poses.size()); ++i) add(i, i + 1, false);
  for (const auto& [from, to] : loops) add(from, to, true);
  return graph;
}

// Three rounds of a square, one pose a metre.
std::vector<Pose3d> Rounds() {
  std::vector<Pose3d> poses;
  for (int i = 0; i < 120; ++i) {
    const int side = (i / 10) % 4;
    const double along = i % 10;
    const double yaw_rad = side * std::numbers::pi / 2.0;
    const double corners[4][2] = {{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}, {0.0, 10.0}};
    poses.push_back(Planar(corners[side][0] + along * std::cos(yaw_rad),
                           corners[side][1] + along * std::sin(yaw_rad), yaw_rad));
  }
  return poses;
}

// A figure of eight whose two lobes look alike, walked twice. Its crossing is at the origin.
std::vector<Pose3d> Eight() {
  std::vector<Pose3d> poses;
  const double radius_m = 8.0;
  for (int i = 0; i < 160; ++i) {
    const double turn = 2.0 * std::numbers::pi * (i % 40) / 40.0;
    const bool is_left = (i / 40) % 2 == 0;
    const double sign = is_left ? 1.0 : -1.0;
    poses.push_back(
        Planar(radius_m * std::sin(turn), sign * radius_m * (1.0 - std::cos(turn)), sign * turn));
  }
  return poses;
}

int KeptCount(const RobustResult& result, size_t first, size_t last) {
  return static_cast<int>(std::count(result.is_kept.begin() + static_cast<std::ptrdiff_t>(first),
                                     result.is_kept.begin() + static_cast<std::ptrdiff_t>(last),
                                     true));
}

TEST(OptimizeRobustly, BelievesTwoLoopsThatAgreeAndNotTheLiar) {
  for (const bool is_planar : {true, false}) {
    Random random(1, 0);
    const std::vector<Pose3d> poses = Rounds();
    PoseGraph graph = Measured(poses, {{2, 42}, {8, 48}}, is_planar, &random);
    graph.edges.push_back(FineEdge(5, 70, Planar(0.5, 0.0, 0.0), true));
    const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, {});
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->loop_count, 3);
    EXPECT_EQ(result->kept_count, 2);
    EXPECT_FALSE(result->is_kept.back());
    EXPECT_EQ(result->rejected_by_consistency_count + result->rejected_by_graduation_count, 1);
    EXPECT_LT(PositionError(result->optimized.poses, poses), 0.5);
    const std::vector<bool> is_consistent = ConsistentLoops(graph, 0.99);
    EXPECT_EQ(is_consistent, result->is_kept);
  }
}

// Each loop of the left lobe is also seen, wrongly, at the same place of the right one.
TEST(OptimizeRobustly, TellsTheLobesOfAnEightApartWithThreeInTenLoopsAliased) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed, 0);
    const std::vector<Pose3d> poses = Eight();
    std::vector<std::pair<int, int>> loops;
    for (int i = 0; i < 70; i += 2) loops.push_back({i, i + 80});
    PoseGraph graph = Measured(poses, loops, true, &random);
    const size_t true_end = graph.edges.size();
    while (graph.edges.size() < true_end + 15) {
      // The same place of the other lobe, mirrored, and far from where the two meet.
      const int i = random.Integer(8, 32);
      graph.edges.push_back(FineEdge(i, i + 120, WithNoise(Pose3d(), &random), true));
    }
    const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, {});
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(KeptCount(*result, true_end, graph.edges.size()), 0) << "seed " << seed;
    EXPECT_GE(KeptCount(*result, 159, true_end), 34) << "seed " << seed;
    EXPECT_LT(PositionError(result->optimized.poses, poses), 0.4) << "seed " << seed;
  }
}

TEST(OptimizeRobustly, KeepsEveryLoopOfASoundGraphAndItsOptimum) {
  Random random(4, 0);
  std::vector<std::pair<int, int>> loops;
  for (int i = 0; i < 80; i += 4) loops.push_back({i, i + 40});
  const PoseGraph graph = Measured(Rounds(), loops, true, &random);
  const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, {});
  const absl::StatusOr<Optimized> plain = Optimize(graph, {});
  ASSERT_TRUE(result.ok() && plain.ok());
  EXPECT_EQ(result->kept_count, result->loop_count);
  EXPECT_NEAR(result->optimized.cost, plain->cost, 1e-6 * plain->cost);
}

TEST(OptimizeRobustly, ConvergesFromEitherHalfOfItsWork) {
  Random random(5, 0);
  const std::vector<Pose3d> poses = Rounds();
  std::vector<std::pair<int, int>> loops;
  for (int i = 0; i < 80; i += 4) loops.push_back({i, i + 40});
  const PoseGraph graph = Measured(poses, loops, true, &random);
  WrongLoopOptions wrong;
  wrong.share = 0.3;
  const PoseGraph spoilt = WithWrongLoops(graph, poses, 50.0, wrong);
  for (const bool is_pairwise : {true, false}) {
    RobustOptions options;
    options.is_pairwise_used = is_pairwise;
    options.is_graduated_used = !is_pairwise;
    const absl::StatusOr<RobustResult> result = OptimizeRobustly(spoilt, options);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(KeptCount(*result, graph.edges.size(), spoilt.edges.size()), 0) << is_pairwise;
    EXPECT_GE(KeptCount(*result, 119, graph.edges.size()), 19) << is_pairwise;
  }
}

TEST(OptimizeRobustly, GivesTheSameAnswerTwice) {
  Random random(6, 0);
  const std::vector<Pose3d> poses = Rounds();
  const PoseGraph graph = Measured(poses, {{2, 42}, {8, 48}, {50, 90}}, true, &random);
  const PoseGraph spoilt = WithWrongLoops(graph, poses, 50.0, {0.5, 1, 3});
  const absl::StatusOr<RobustResult> first = OptimizeRobustly(spoilt, {});
  const absl::StatusOr<RobustResult> second = OptimizeRobustly(spoilt, {});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->is_kept, second->is_kept);
  for (size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(first->optimized.poses[i].position, second->optimized.poses[i].position);
  }
}

TEST(OptimizeRobustly, JoinsPartsOfTrajectoryByTheLoopsBetweenThem) {
  Random random(7, 0);
  const std::vector<Pose3d> poses = Rounds();
  std::vector<std::pair<int, int>> loops;
  for (int i = 0; i < 40; i += 4) loops.push_back({i, i + 80});
  PoseGraph graph = Measured(poses, loops, true, &random);
  graph.edges.erase(graph.edges.begin() + 59);
  const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->kept_count, 10);
  EXPECT_LT(PositionError(result->optimized.poses, poses), 0.5);
}

TEST(OptimizeRobustly, TakesGraphsWithoutLoopsAndWithoutPoses) {
  Random random(8, 0);
  const PoseGraph graph = Measured(Rounds(), {}, false, &random);
  const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->loop_count, 0);
  const absl::StatusOr<RobustResult> nothing = OptimizeRobustly(PoseGraph(), {});
  EXPECT_TRUE(nothing.ok()) << nothing.status();
}

TEST(OptimizeRobustly, RefusesWhatOptimizeRefuses) {
  Random random(9, 0);
  PoseGraph graph = Measured(Rounds(), {{2, 42}}, true, &random);
  graph.edges.back().to = 1000;
  EXPECT_EQ(ReasonOf(OptimizeRobustly(graph, {}).status()), Reason::kFieldInvalid);
  graph.edges.back().to = 42;
  graph.edges.back().from_T_to.position.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ReasonOf(OptimizeRobustly(graph, {}).status()), Reason::kFieldInvalid);
}

// What a solution does on its way, and what it ends with.
struct Course {
  std::map<std::string, int64_t> work;
  std::vector<bool> is_kept;
  double cost = 0.0;

  bool operator==(const Course&) const = default;
};

Course CourseOf(const PoseGraph& graph, RobustOptions options) {
  Course course;
  options.on_work = [&course](const char* what, int64_t done, int64_t total) {
    ++course.work[what];
    course.work[std::string(what) + " of"] += total * (done + 1);
  };
  const absl::StatusOr<RobustResult> result = OptimizeRobustly(graph, options);
  EXPECT_TRUE(result.ok()) << result.status();
  if (!result.ok()) return course;
  course.is_kept = result->is_kept;
  course.cost = result->optimized.cost;
  return course;
}

// Far from its default each number makes the solution of one of these graphs take another course;
// but for three, which decide on loops that are nearly as likely right as wrong.
TEST(OptimizeRobustly, ReadsEachOfItsNumbers) {
  std::vector<PoseGraph> graphs;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed, 0);
    const std::vector<Pose3d> poses = Rounds();
    std::vector<std::pair<int, int>> loops;
    for (int i = 0; i < 80; i += 4) loops.push_back({i, i + 40});
    PoseGraph graph = Measured(poses, loops, seed % 2 == 0, &random);
    // Noise is not always what information says.
    for (RelativePose& edge : graph.edges)
      edge.information *= std::vector{0.02, 1.0, 5.0}[seed % 3];
    graphs.push_back(
        WithWrongLoops(graph, poses, 50.0, {0.7, 1 + static_cast<int>(seed % 2), seed}));
  }
  std::vector<Course> usual;
  for (const PoseGraph& graph : graphs) usual.push_back(CourseOf(graph, {}));
  EXPECT_EQ(CourseOf(graphs[0], {}), usual[0]);
  RobustOptions options;
  const std::set<std::string> others = {"loop-doubtful-share", "loop-noise-freedom", "loop-alike"};
  for (const BoundOption& field : options.Bind()) {
    if (others.contains(field.name)) continue;
    const double before = field.Get();
    bool is_read = false;
    for (const double number : {field.min, field.max}) {
      field.Set(number);
      for (size_t i = 0; i < graphs.size() && !is_read; ++i) {
        is_read = !(CourseOf(graphs[i], options) == usual[i]);
      }
    }
    field.Set(before);
    EXPECT_TRUE(is_read) << field.name;
  }
}

TEST(NoiseScale, IsLearnedFromEnoughLoopsOnly) {
  Random random(3, 0);
  const std::vector<Pose3d> poses = Rounds();
  PoseGraph graph = Measured(poses, {{2, 42}, {8, 48}, {14, 54}}, false, &random);
  for (RelativePose& edge : graph.edges) edge.information *= 1e-4;
  const std::vector<bool> all(graph.edges.size(), true);
  EvidenceOptions evidence;
  EXPECT_EQ(NoiseScaleOf(graph, poses, all, evidence), 1.0);
  evidence.noise_freedom_min = 18;
  const double scale = NoiseScaleOf(graph, poses, all, evidence);
  EXPECT_LT(scale, 0.1);
  evidence.noise_margin *= 0.5;
  EXPECT_NEAR(NoiseScaleOf(graph, poses, all, evidence), 0.5 * scale, 1e-9 * scale);
}

TEST(Graduate, EndsWithWeightsOfZeroAndOne) {
  Random random(10, 0);
  const std::vector<Pose3d> poses = Rounds();
  std::vector<std::pair<int, int>> loops;
  for (int i = 0; i < 80; i += 4) loops.push_back({i, i + 40});
  const PoseGraph graph = Measured(poses, loops, true, &random);
  const PoseGraph spoilt = WithWrongLoops(graph, poses, 50.0, {0.4, 1, 5});
  const absl::StatusOr<Graduation> graduated =
      Graduate(spoilt, poses, std::vector<bool>(spoilt.edges.size(), true), {});
  ASSERT_TRUE(graduated.ok()) << graduated.status();
  EXPECT_TRUE(graduated->is_converged);
  for (size_t e = 0; e < spoilt.edges.size(); ++e) {
    EXPECT_EQ(graduated->weights[e], e < graph.edges.size() ? 1.0 : 0.0) << e;
  }
}

}  // namespace
}  // namespace dsg::ingest
