// SPDX-License-Identifier: Apache-2.0
// A robot that goes round a square twice, and what is said of where it came back.
#include "ingest/evaluation/loops.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::evaluation {
namespace {

constexpr TimeNs kLapNs = 40 * kNsPerSecond;

// 10 m a side at a metre a second, looking ahead.
Pose3d PoseAt(TimeNs time_ns) {
  const double along = static_cast<double>(time_ns % kLapNs) / static_cast<double>(kNsPerSecond);
  const int side = static_cast<int>(along / 10.0);
  const double rest = along - 10.0 * side;
  const Eigen::Vector3d corners[] = {{0, 0, 1}, {10, 0, 1}, {10, 10, 1}, {0, 10, 1}};
  const Eigen::Vector3d step = (corners[(side + 1) % 4] - corners[side]) / 10.0;
  return {corners[side] + rest * step,
          Eigen::Quaterniond(Eigen::AngleAxisd(side * M_PI / 2, Eigen::Vector3d::UnitZ()))};
}

std::vector<StampedPose> Laps(TimeNs until_ns) {
  std::vector<StampedPose> truth;
  for (TimeNs time_ns = 0; time_ns <= until_ns; time_ns += kNsPerSecond / 20) {
    truth.push_back({time_ns, PoseAt(time_ns)});
  }
  return truth;
}

FoundLoop TrueLoop(TimeNs from_ns, TimeNs to_ns) {
  return {from_ns, to_ns, PoseAt(from_ns).Inverse() * PoseAt(to_ns)};
}

LoopResult Evaluated(const std::vector<FoundLoop>& loops, const LoopOptions& options = {}) {
  return EvaluateLoops(loops, Laps(2 * kLapNs), 0, 2 * kLapNs, kTruthGapNsMax, options);
}

TEST(LoopScore, KnowsRightFromWrong) {
  FoundLoop near = TrueLoop(3 * kNsPerSecond, 43 * kNsPerSecond);
  near.from_T_to.position.x() += 0.49;
  FoundLoop off = near;
  off.from_T_to.position.x() += 0.02;
  FoundLoop turned = TrueLoop(3 * kNsPerSecond, 43 * kNsPerSecond);
  turned.from_T_to.orientation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  // Between places that have nothing to do with each other, and still right.
  const FoundLoop far = TrueLoop(3 * kNsPerSecond, 25 * kNsPerSecond);
  const LoopResult result = Evaluated({near, off, turned, far});
  EXPECT_EQ(result.believed.judged_count, 4);
  EXPECT_EQ(result.believed.right_count, 2);
  EXPECT_DOUBLE_EQ(*result.precision, 0.5);
}

TEST(LoopScore, DoesNotCareWhichEndIsNamedFirst) {
  const FoundLoop there = TrueLoop(3 * kNsPerSecond, 43 * kNsPerSecond);
  const FoundLoop back = TrueLoop(43 * kNsPerSecond, 3 * kNsPerSecond);
  EXPECT_EQ(Evaluated({there}).found_count, Evaluated({back}).found_count);
  EXPECT_EQ(Evaluated({back}).believed.right_count, 1);
}

TEST(LoopScore, CountsWhatWasLeftOutApart) {
  FoundLoop right = TrueLoop(3 * kNsPerSecond, 43 * kNsPerSecond);
  right.is_believed = false;
  FoundLoop wrong = right;
  wrong.from_T_to.position.x() += 5.0;
  const LoopResult result = Evaluated({right, wrong});
  EXPECT_EQ(result.left_out.judged_count, 2);
  EXPECT_EQ(result.left_out.right_count, 1);
  EXPECT_FALSE(result.precision.has_value());
  EXPECT_EQ(result.found_count, 0);
}

TEST(LoopScore, RecallIsTheShareOfRevisitsNearARightLoop) {
  // The second lap, and the last two metres of the first, where the start is near again but the
  // robot looks elsewhere: a quarter turn is more than 60 degrees.
  const LoopResult none = Evaluated({});
  EXPECT_EQ(none.revisit_count, 41);
  EXPECT_DOUBLE_EQ(*none.recall, 0.0);
  const LoopResult one = Evaluated({TrueLoop(20 * kNsPerSecond, 60 * kNsPerSecond)});
  EXPECT_EQ(one.found_count, 11);
  EXPECT_DOUBLE_EQ(*one.recall, 11.0 / 41.0);
  std::vector<FoundLoop> loops;
  for (int second = 40; second <= 80; second += 10) {
    loops.push_back(TrueLoop((second - 40) * kNsPerSecond, second * kNsPerSecond));
  }
  EXPECT_DOUBLE_EQ(*Evaluated(loops).recall, 1.0);
  for (FoundLoop& loop : loops) loop.from_T_to.position.y() += 1.0;
  EXPECT_DOUBLE_EQ(*Evaluated(loops).recall, 0.0);
}

TEST(LoopScore, ALoopOverAMomentFindsNoRevisit) {
  const LoopResult result = Evaluated({TrueLoop(58 * kNsPerSecond, 60 * kNsPerSecond)});
  EXPECT_EQ(result.believed.right_count, 1);
  EXPECT_EQ(result.found_count, 0);
}

TEST(LoopScore, ViewsOfAnyDirectionCountIfAskedFor) {
  LoopOptions options;
  options.revisit_deg = 180.0;
  // The start is within 2 m from second 38 on.
  EXPECT_EQ(Evaluated({}, options).revisit_count, 43);
}

TEST(LoopScore, WhoStandsOrNeverComesBackRevisitsNothing) {
  std::vector<StampedPose> truth;
  for (int i = 0; i <= 2000; ++i) truth.push_back({i * kNsPerSecond / 20, PoseAt(0)});
  const LoopResult still = EvaluateLoops({}, truth, 0, kTimeMax, kTruthGapNsMax, {});
  EXPECT_EQ(still.revisit_count, 0);
  EXPECT_FALSE(still.recall.has_value());
  EXPECT_EQ(
      EvaluateLoops({}, Laps(30 * kNsPerSecond), 0, kTimeMax, kTruthGapNsMax, {}).revisit_count, 0);
}

TEST(LoopScore, JudgesNothingWhereThereIsNoTruth) {
  std::vector<StampedPose> truth = Laps(2 * kLapNs);
  // Seconds 2 to 4 are missing.
  truth.erase(truth.begin() + 40, truth.begin() + 80);
  const LoopResult result = EvaluateLoops({TrueLoop(3 * kNsPerSecond, 43 * kNsPerSecond),
                                           TrueLoop(5 * kNsPerSecond, 300 * kNsPerSecond)},
                                          truth, 0, 2 * kLapNs, kTruthGapNsMax, {});
  EXPECT_EQ(result.believed.unjudged_count, 2);
  EXPECT_EQ(result.believed.judged_count, 0);
  EXPECT_EQ(EvaluateLoops({}, {}, 0, 1, kTruthGapNsMax, {}).revisit_count, 0);
}

TEST(LoopScore, LooksForRevisitsOnlyWhileTheRobotHasATrack) {
  const std::vector<StampedPose> truth = Laps(2 * kLapNs);
  EXPECT_EQ(EvaluateLoops({}, truth, 0, 60 * kNsPerSecond, kTruthGapNsMax, {}).revisit_count, 21);
  EXPECT_EQ(EvaluateLoops({}, truth, 50 * kNsPerSecond, kTimeMax, kTruthGapNsMax, {}).revisit_count,
            0);
}

TEST(LoopScore, RefusesOptionsOutOfRange) {
  EXPECT_TRUE(ingest::ValidateOptions(LoopOptions()).ok());
  LoopOptions options;
  options.revisit_m = 0.0;
  EXPECT_FALSE(ingest::ValidateOptions(options).ok());
  options = {};
  options.step_ns = 0;
  EXPECT_FALSE(ingest::ValidateOptions(options).ok());
}

}  // namespace
}  // namespace dsg::evaluation
