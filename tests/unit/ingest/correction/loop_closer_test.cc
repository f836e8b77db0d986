// SPDX-License-Identifier: Apache-2.0
// When a path is corrected while its log runs, and by how much.
#include "ingest/correction/loop_closer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::ingest {
namespace {

constexpr TimeNs kStepNs = 200'000'000;
constexpr int kRound = 160;

Pose3d RobotPose(double x, double y, double yaw_rad) {
  Pose3d pose;
  pose.position = {x, y, 0.5};
  pose.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

// A round of 32 m, again and again.
Pose3d TruePose(int step) {
  const double angle = 2.0 * M_PI * step / kRound;
  return RobotPose(5.0 * std::cos(angle), 5.0 * std::sin(angle), angle + 0.5 * M_PI);
}

// Odometry that goes 3 mm astray with each step.
Pose3d GivenPose(int step) {
  Pose3d pose = TruePose(step);
  pose.position.x() += 0.003 * step;
  return pose;
}

Measurement LoopBack(int step) {
  LoopMeasurement loop;
  loop.from_ns = static_cast<TimeNs>(step - kRound) * kStepNs;
  loop.time_ns = static_cast<TimeNs>(step) * kStepNs;
  loop.from_T_to = TruePose(step - kRound).Inverse() * TruePose(step);
  loop.information.diagonal() << 400.0, 400.0, 400.0, 3000.0, 3000.0, 3000.0;
  loop.origin = "loops.jsonl";
  return loop;
}

class LoopCloserTest : public testing::Test {
 protected:
  void Drive(int until) {
    for (; step_ <= until; ++step_) {
      path_.Add({.time_ns = static_cast<TimeNs>(step_) * kStepNs, .map_T_agent = GivenPose(step_)});
    }
  }
  TrajectoryChange Correct(bool is_last = false) {
    const auto change = closer_.Correct(static_cast<TimeNs>(step_) * kStepNs, is_last);
    EXPECT_TRUE(change.ok()) << change.status();
    return change.value_or(TrajectoryChange());
  }
  double ErrorM(int step) const {
    Pose3d pose;
    EXPECT_EQ(path_.At(static_cast<TimeNs>(step) * kStepNs, &pose), RobotPath::Answer::kKnown);
    return (pose.position - TruePose(step).position).norm();
  }

  RobotPath path_;
  LoopCloser closer_{RobotGraphOptions(), &path_, /*is_on=*/true};
  int step_ = 0;
};

TEST_F(LoopCloserTest, CorrectsThePathWhileTheLogRuns) {
  Drive(kRound + 5);
  EXPECT_TRUE(Correct().IsIdentity());
  EXPECT_TRUE(closer_.Take(LoopBack(kRound)));
  const TrajectoryChange change = Correct();
  EXPECT_FALSE(change.IsIdentity());
  EXPECT_TRUE(path_.is_corrected());
  EXPECT_LT(ErrorM(kRound), 0.1);
  // What comes next is where the corrected path goes on.
  Drive(kRound + 20);
  EXPECT_LT(ErrorM(kRound + 20), 0.2);
  EXPECT_GT((GivenPose(kRound + 20).position - TruePose(kRound + 20).position).norm(), 0.5);
}

TEST_F(LoopCloserTest, IsInNoHurry) {
  Drive(kRound + 5);
  closer_.Take(LoopBack(kRound));
  EXPECT_FALSE(Correct().IsIdentity());
  // Nothing new; and then it is too soon, until ten seconds have passed.
  Drive(kRound + 30);
  EXPECT_TRUE(Correct().IsIdentity());
  closer_.Take(LoopBack(kRound + 28));
  EXPECT_TRUE(Correct().IsIdentity());
  Drive(2 * kRound);
  closer_.Take(LoopBack(2 * kRound - 1));
  EXPECT_FALSE(Correct().IsIdentity());
  EXPECT_LT(ErrorM(2 * kRound - 1), 0.1);
}

// Corrections write track and mesh anew: of a long log they are fewer.
TEST_F(LoopCloserTest, WaitsForAShareOfTheLog) {
  RobotGraphOptions options;
  options.correct_share = 0.6;
  LoopCloser seldom(options, &path_, true);
  const auto correct = [&] {
    return seldom.Correct(static_cast<TimeNs>(step_) * kStepNs, false).value_or(TrajectoryChange());
  };
  Drive(kRound + 5);
  seldom.Take(LoopBack(kRound));
  EXPECT_FALSE(correct().IsIdentity());
  Drive(2 * kRound);
  seldom.Take(LoopBack(2 * kRound - 1));
  EXPECT_TRUE(correct().IsIdentity());
  Drive(3 * kRound);
  EXPECT_FALSE(correct().IsIdentity());
}

TEST_F(LoopCloserTest, ASmallShiftWaitsForTheEnd) {
  RobotGraphOptions options;
  options.correct_min_m = 10.0;
  LoopCloser patient(options, &path_, true);
  Drive(kRound + 5);
  patient.Take(LoopBack(kRound));
  const auto none = patient.Correct(static_cast<TimeNs>(step_) * kStepNs, false);
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->IsIdentity());
  EXPECT_FALSE(path_.is_corrected());
  const auto last = patient.Correct(static_cast<TimeNs>(step_) * kStepNs, true);
  ASSERT_TRUE(last.ok());
  EXPECT_FALSE(last->IsIdentity());
  EXPECT_EQ(patient.counts().kept_count, 1);
}

TEST_F(LoopCloserTest, ManyLoopsWaitForTheEnd) {
  RobotGraphOptions options;
  options.correct_loop_count_max = 0;
  LoopCloser patient(options, &path_, true);
  Drive(kRound + 5);
  patient.Take(LoopBack(kRound));
  const TimeNs now_ns = static_cast<TimeNs>(step_) * kStepNs;
  EXPECT_TRUE(patient.Correct(now_ns, false).value_or(TrajectoryChange()).IsIdentity());
  EXPECT_EQ(patient.counts().loop_count, 0);
  EXPECT_FALSE(patient.Correct(now_ns, true).value_or(TrajectoryChange()).IsIdentity());
}

TEST_F(LoopCloserTest, CountsWhatIsSaidAgain) {
  Drive(kRound + 5);
  for (int i = 0; i < 50; ++i) closer_.Take(LoopBack(kRound));
  Correct(/*is_last=*/true);
  EXPECT_EQ(closer_.counts().loop_count, 50);
  EXPECT_EQ(closer_.counts().kept_count, 1);
  EXPECT_EQ(closer_.counts().repeated_count, 49);
  EXPECT_TRUE(closer_.counts().doubted.empty());
}

TEST_F(LoopCloserTest, PosesCarryTheCovariancesOfTheCorrectedPath) {
  Drive(kRound + 5);
  closer_.Take(LoopBack(kRound));
  Correct(/*is_last=*/true);
  const std::vector<TimedPose> poses = closer_.CorrectedPoses();
  ASSERT_EQ(poses.size(), path_.poses().size());
  for (const TimedPose& pose : poses) {
    ASSERT_NE(pose.covariance, nullptr);
    EXPECT_TRUE(pose.flags & pose_flags::kCorrected);
  }
  const auto factors = closer_.Factors();
  ASSERT_TRUE(factors.ok());
  EXPECT_EQ(factors->back().type, "loop_closure");
}

// Also if nothing has moved since the last loop closure.
TEST_F(LoopCloserTest, TheEndBringsCovariancesToAPathThatWasCorrectedBefore) {
  Drive(kRound + 5);
  closer_.Take(LoopBack(kRound));
  EXPECT_FALSE(Correct().IsIdentity());
  for (const TimedPose& pose : closer_.CorrectedPoses()) ASSERT_EQ(pose.covariance, nullptr);
  EXPECT_FALSE(Correct(/*is_last=*/true).IsIdentity());
  for (const TimedPose& pose : closer_.CorrectedPoses()) ASSERT_NE(pose.covariance, nullptr);
}

TEST_F(LoopCloserTest, WithoutLoopsTheEndMovesNothing) {
  Drive(kRound);
  EXPECT_TRUE(Correct(/*is_last=*/true).IsIdentity());
  EXPECT_FALSE(path_.is_corrected());
}

TEST_F(LoopCloserTest, OffItTakesAndCorrectsNothing) {
  LoopCloser off(RobotGraphOptions(), &path_, /*is_on=*/false);
  Drive(kRound + 5);
  EXPECT_FALSE(off.Take(LoopBack(kRound)));
  EXPECT_TRUE(off.Correct(0, true)->IsIdentity());
  EXPECT_TRUE(off.Factors()->empty());
}

}  // namespace
}  // namespace dsg::ingest
