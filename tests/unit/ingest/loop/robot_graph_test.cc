// SPDX-License-Identifier: Apache-2.0
// The robot's pose graph: drift that a loop closes, loops that lie, and how things move with it.
#include "ingest/loop/robot_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>

#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr double kPi = 3.14159265358979;
constexpr TimeNs kStepNs = 200'000'000;

Pose3d RobotPose(double x, double y, double yaw_rad) {
  Pose3d pose;
  pose.position = {x, y, 1.0};
  pose.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

// Three times around a square of 8 m, a step of 0.2 m each 0.2 s, turning on the spot at corners.
std::vector<Pose3d> SquareWay() {
  std::vector<Pose3d> way = {RobotPose(0.0, 0.0, 0.0)};
  for (int side = 0; side < 12; ++side) {
    for (int i = 0; i < 40; ++i) way.push_back(way.back() * RobotPose(0.2, 0.0, 0.0));
    for (int i = 0; i < 9; ++i) way.push_back(way.back() * RobotPose(0.0, 0.0, kPi / 18.0));
  }
  for (Pose3d& pose : way) pose.position.z() = 1.0;
  return way;
}

// What odometry makes of it: each step a little off.
std::vector<Pose3d> Drifted(const std::vector<Pose3d>& way, uint64_t seed) {
  Random random(seed, 0);
  std::vector<Pose3d> odometry = {way.front()};
  for (size_t i = 1; i < way.size(); ++i) {
    Pose3d step = way[i - 1].Inverse() * way[i];
    const double walk = std::sqrt(step.position.norm());
    step.position.x() += 0.02 * walk * random.Normal();
    step.position.y() += 0.02 * walk * random.Normal();
    step.orientation = step.orientation *
                       Eigen::AngleAxisd(0.01 * walk * random.Normal(), Eigen::Vector3d::UnitZ());
    odometry.push_back(odometry.back() * step);
  }
  return odometry;
}

double RmsM(const std::vector<Pose3d>& a, const std::vector<Pose3d>& b) {
  double sum_m2 = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum_m2 += (a[i].position - b[i].position).squaredNorm();
  return std::sqrt(sum_m2 / static_cast<double>(a.size()));
}

LoopClosure MakeLoop(const std::vector<Pose3d>& way, size_t from, size_t to) {
  LoopClosure loop;
  loop.from_ns = static_cast<TimeNs>(from) * kStepNs;
  loop.to_ns = static_cast<TimeNs>(to) * kStepNs;
  loop.from_T_to = way[from].Inverse() * way[to];
  loop.information.diagonal() << 400.0, 400.0, 400.0, 3000.0, 3000.0, 3000.0;
  return loop;
}

class RobotGraphTest : public testing::Test {
 protected:
  static constexpr size_t kRound = 4 * 49;

  explicit RobotGraphTest(uint64_t seed = 1) { Begin(seed); }

  void Begin(uint64_t seed) {
    way_ = SquareWay();
    odometry_ = Drifted(way_, seed);
    path_ = RobotPath();
    graph_.emplace(RobotGraphOptions(), path_);
    for (size_t i = 0; i < odometry_.size(); ++i) {
      path_.Add({.time_ns = static_cast<TimeNs>(i) * kStepNs, .map_T_agent = odometry_[i]});
    }
  }

  // One spot of each side is recognised in the next round.
  void AddRightLoops() {
    for (size_t i = 10; i + kRound < way_.size(); i += 49) {
      graph_->AddLoop(MakeLoop(way_, i, i + kRound));
    }
  }

  std::vector<Pose3d> Corrected(const TrajectoryChange& change) const {
    std::vector<Pose3d> poses;
    for (size_t i = 0; i < odometry_.size(); ++i) {
      poses.push_back(change.At(static_cast<TimeNs>(i) * kStepNs) * odometry_[i]);
    }
    return poses;
  }

  std::vector<Pose3d> way_;
  std::vector<Pose3d> odometry_;
  RobotPath path_;
  std::optional<RobotGraph> graph_;
};

TEST_F(RobotGraphTest, WithoutLoopsNothingMoves) {
  const auto solution = graph_->Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_TRUE(solution->change.IsIdentity());
  EXPECT_TRUE(solution->covariances.empty());
  EXPECT_GT(solution->keyframe_times.size(), 100u);
  EXPECT_EQ(graph_->Factors(*solution).size(), solution->keyframe_times.size() - 1);
}

TEST_F(RobotGraphTest, LoopsHalveTheDriftOfASquare) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    Begin(seed);
    AddRightLoops();
    const auto solution = graph_->Solve();
    ASSERT_TRUE(solution.ok()) << solution.status();
    EXPECT_EQ(solution->kept_count, solution->loop_count);
    const double before_m = RmsM(odometry_, way_);
    const double after_m = RmsM(Corrected(solution->change), way_);
    RecordProperty("seed_" + std::to_string(seed),
                   std::to_string(before_m) + " -> " + std::to_string(after_m));
    EXPECT_LT(after_m, 0.5 * before_m) << before_m;
  }
}

TEST_F(RobotGraphTest, LoopsThatLieAreToldAsRejected) {
  AddRightLoops();
  const size_t right_count = (way_.size() - 11 - kRound) / 49 + 1;
  for (size_t i = 20; i < 200; i += 40) {
    LoopClosure wrong = MakeLoop(way_, i, i + 90);
    wrong.from_T_to = RobotPose(0.3, 0.2, 0.5);
    graph_->AddLoop(wrong);
  }
  const auto solution = graph_->Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  for (size_t i = 0; i < solution->is_kept.size(); ++i) {
    EXPECT_EQ(solution->is_kept[i], i < right_count) << i;
  }
  EXPECT_LT(RmsM(Corrected(solution->change), way_), 0.5 * RmsM(odometry_, way_));
  int64_t rejected_count = 0;
  for (const PoseFactor& factor : graph_->Factors(*solution)) {
    rejected_count += factor.type == "loop_closure_rejected" ? 1 : 0;
    EXPECT_TRUE(factor.information.has_value());
  }
  EXPECT_EQ(rejected_count, 5);
}

// Their ends are keyframes, and odometry is worth no less for it.
TEST_F(RobotGraphTest, LoopsThatAreNotBelievedMoveNothing) {
  AddRightLoops();
  const auto right = graph_->Solve();
  ASSERT_TRUE(right.ok()) << right.status();
  Random random(5, 0);
  for (int i = 0; i < 300; ++i) {
    const auto from = static_cast<size_t>(random.Uniform(0.0, static_cast<double>(kRound)));
    LoopClosure wrong = MakeLoop(way_, from, from + 90);
    wrong.from_T_to = RobotPose(random.Uniform(-1e4, 1e4), random.Uniform(-1e4, 1e4), 0.5);
    graph_->AddLoop(wrong);
  }
  const auto crowded = graph_->Solve();
  ASSERT_TRUE(crowded.ok()) << crowded.status();
  ASSERT_EQ(crowded->kept_count, right->kept_count);
  EXPECT_GT(crowded->keyframe_times.size(), right->keyframe_times.size() * 5 / 4);
  const double moved_m = RmsM(Corrected(right->change), odometry_);
  EXPECT_LT(RmsM(Corrected(crowded->change), Corrected(right->change)), 0.03 * moved_m);
}

TEST_F(RobotGraphTest, CountsLoopsThatNobodyCanUse) {
  AddRightLoops();
  LoopClosure early = MakeLoop(way_, 0, kRound);
  early.from_ns = -1;
  LoopClosure late = MakeLoop(way_, 0, kRound);
  late.to_ns = static_cast<TimeNs>(way_.size()) * kStepNs;
  LoopClosure same = MakeLoop(way_, 30, 30);
  same.to_ns += 1000;
  for (const LoopClosure& loop : {early, late, same}) graph_->AddLoop(loop);
  const auto solution = graph_->Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->unusable_count, 3);
  EXPECT_EQ(solution->loop_count, solution->kept_count + 3);
}

// Fifty copies of a lie would bear each other out, and fifty of the truth would outweigh odometry.
TEST_F(RobotGraphTest, WhatIsSaidFiftyTimesCountsOnce) {
  LoopClosure wrong = MakeLoop(way_, 20, 110);
  wrong.from_T_to = RobotPose(0.3, 0.2, 0.5);
  const auto solve = [&](int copy_count) {
    graph_.emplace(RobotGraphOptions(), path_);
    AddRightLoops();
    for (int i = 0; i < copy_count; ++i) {
      graph_->AddLoop(wrong);
      graph_->AddLoop(MakeLoop(way_, 10, 10 + kRound));
    }
    return graph_->Solve();
  };
  const auto once = solve(1);
  const auto often = solve(50);
  ASSERT_TRUE(once.ok() && often.ok());
  const size_t right_count = (way_.size() - 11 - kRound) / 49 + 1;
  EXPECT_EQ(once->repeated_count, 1);
  EXPECT_EQ(often->loop_count, static_cast<int64_t>(right_count) + 100);
  EXPECT_EQ(often->repeated_count, 99);
  EXPECT_EQ(often->unusable_count, 0);
  EXPECT_EQ(often->kept_count, static_cast<int64_t>(right_count));
  for (size_t i = 0; i < often->is_kept.size(); ++i) {
    EXPECT_EQ(often->is_kept[i], i < right_count) << i;
    EXPECT_EQ(often->is_repeated[i], i > right_count) << i;
  }
  EXPECT_EQ(RmsM(Corrected(often->change), Corrected(once->change)), 0.0);
  EXPECT_EQ(graph_->Factors(*often).size(), often->keyframe_times.size() - 1 + right_count + 1);
}

TEST_F(RobotGraphTest, TellsWhatTakesLong) {
  RobotGraphOptions options;
  std::set<std::string> told;
  options.robust.on_work = [&told](const char* what, int64_t done, int64_t total) {
    EXPECT_TRUE(total == 0 || done <= total) << what;
    told.insert(what);
  };
  graph_.emplace(options, path_);
  AddRightLoops();
  LoopClosure wrong = MakeLoop(way_, 20, 110);
  wrong.from_T_to = RobotPose(0.3, 0.2, 0.5);
  graph_->AddLoop(wrong);
  ASSERT_TRUE(graph_->Solve().ok());
  for (const char* what : {"comparing pairs of loop closures", "choosing loop closures that agree",
                           "judging doubtful loop closures", "solving the path, step",
                           "finding covariances of poses"}) {
    EXPECT_TRUE(told.contains(what)) << what;
  }
}

TEST_F(RobotGraphTest, LoopsMayComeBeforeTheirPosesAndBetweenThem) {
  RobotPath path;
  RobotGraph graph(RobotGraphOptions(), path);
  for (size_t i = 10; i + kRound < way_.size(); i += 49) {
    LoopClosure loop = MakeLoop(way_, i, i + kRound);
    // Between two poses of a robot that drives straight on: 0.08 m further.
    loop.to_ns += 2 * kStepNs / 5;
    loop.from_T_to = loop.from_T_to * RobotPose(0.08, 0.0, 0.0);
    loop.from_T_to.position.z() = 0.0;
    graph.AddLoop(loop);
  }
  for (size_t i = 0; i < odometry_.size(); ++i) {
    path.Add({.time_ns = static_cast<TimeNs>(i) * kStepNs, .map_T_agent = odometry_[i]});
  }
  const auto solution = graph.Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->kept_count, solution->loop_count);
  EXPECT_LT(RmsM(Corrected(solution->change), way_), 0.5 * RmsM(odometry_, way_));
}

TEST_F(RobotGraphTest, KeepsTheRobotLevelWhateverLoopsSay) {
  Random random(3, 0);
  for (size_t i = 10; i + kRound < way_.size(); i += 49) {
    LoopClosure loop = MakeLoop(way_, i, i + kRound);
    loop.from_T_to.orientation =
        loop.from_T_to.orientation *
        Eigen::AngleAxisd(0.03 * random.Normal(), Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(0.03 * random.Normal(), Eigen::Vector3d::UnitY());
    graph_->AddLoop(loop);
  }
  const auto solution = graph_->Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_FALSE(solution->change.IsIdentity());
  for (const Pose3d& pose : Corrected(solution->change)) {
    EXPECT_GT((pose.orientation * Eigen::Vector3d::UnitZ()).z(), std::cos(0.01));
  }
}

TEST_F(RobotGraphTest, IsMoreCertainNearTheStartAndAfterALoop) {
  AddRightLoops();
  const auto solution = graph_->Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  ASSERT_EQ(solution->covariances.size(), solution->keyframe_times.size());
  for (const Covariance6& covariance : solution->covariances) {
    for (const size_t diagonal : {0, 6, 11, 15, 18, 20}) {
      EXPECT_GE(covariance[diagonal], 0.0f);
      EXPECT_LT(covariance[diagonal], 1.0f);
    }
  }
  EXPECT_LT(solution->covariances[1][0], solution->covariances.back()[0]);
}

TEST_F(RobotGraphTest, ALongLogTakesKeyframesFurtherApartAndDoesNotFail) {
  RobotGraphOptions options;
  options.keyframe_count_max = 60;
  RobotGraph graph(options, path_);
  for (size_t i = 10; i + kRound < way_.size(); i += 49) {
    graph.AddLoop(MakeLoop(way_, i, i + kRound));
  }
  const auto solution = graph.Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_GT(solution->keyframe_spread, 1.0);
  EXPECT_LE(solution->keyframe_times.size(), 60u);
  EXPECT_EQ(solution->kept_count, solution->loop_count);
  EXPECT_LT(RmsM(Corrected(solution->change), way_), 0.5 * RmsM(odometry_, way_));
}

// Loops may bind more poses than covariances are found of: the correction comes without them.
TEST_F(RobotGraphTest, MorePosesThanHaveCovariancesAreSolved) {
  AddRightLoops();
  const auto with = graph_->Solve();
  ASSERT_TRUE(with.ok()) << with.status();
  RobotGraphOptions options;
  options.covariance_count_max = static_cast<int>(with->keyframe_times.size()) - 1;
  graph_.emplace(options, path_);
  AddRightLoops();
  const auto without = graph_->Solve();
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_EQ(with->covariances.size(), with->keyframe_times.size());
  EXPECT_TRUE(without->covariances.empty());
  EXPECT_EQ(RmsM(Corrected(without->change), Corrected(with->change)), 0.0);
}

TEST_F(RobotGraphTest, TheSameInputGivesTheSameBits) {
  AddRightLoops();
  const auto a = graph_->Solve();
  const auto b = graph_->Solve();
  ASSERT_TRUE(a.ok() && b.ok());
  for (TimeNs t = 0; t < 100 * kNsPerSecond; t += 777'777'777) {
    EXPECT_EQ(a->change.At(t).position, b->change.At(t).position);
    EXPECT_EQ(a->change.At(t).orientation.coeffs(), b->change.At(t).orientation.coeffs());
  }
}

TEST(RobotGraph, IsEmptyWithoutPoses) {
  const RobotPath path;
  RobotGraph graph(RobotGraphOptions(), path);
  graph.AddLoop(LoopClosure{.from_ns = 1, .to_ns = 2});
  const auto solution = graph.Solve();
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_TRUE(solution->change.IsIdentity());
  EXPECT_EQ(solution->unusable_count, 1);
  EXPECT_TRUE(graph.Factors(*solution).empty());
}

}  // namespace
}  // namespace dsg::ingest
