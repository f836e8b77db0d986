// SPDX-License-Identifier: Apache-2.0
// Drift is a random walk of the stated size, and loop closures are right or wrong as asked.
#include "ingest/simulator/motion/odometry_drift.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

constexpr TimeNs kStepNs = 50'000'000;

// Round and round a circle of 3 m at 1 m/s.
std::vector<StampedPose> CircleWay(double seconds) {
  std::vector<StampedPose> way;
  for (int i = 0; i * 0.05 < seconds; ++i) {
    const double angle_rad = i * 0.05 / 3.0;
    StampedPose pose;
    pose.time_ns = 1'000'000 + i * kStepNs;
    pose.map_T_body.position = {3.0 * std::sin(angle_rad), 3.0 - 3.0 * std::cos(angle_rad), 1.2};
    pose.map_T_body.orientation = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ());
    way.push_back(pose);
  }
  return way;
}

Pose3d Relative(const std::vector<StampedPose>& way, TimeNs from_ns, TimeNs to_ns) {
  const auto at = [&way](TimeNs t) {
    return way[static_cast<size_t>((t - way.front().time_ns) / kStepNs)].map_T_body;
  };
  return at(from_ns).Inverse() * at(to_ns);
}

TEST(OdometryDrift, BeginsAtTheTruthAndStaysLevel) {
  const std::vector<StampedPose> way = CircleWay(60.0);
  const std::vector<StampedPose> odometry = AddDrift(way, {});
  ASSERT_EQ(odometry.size(), way.size());
  EXPECT_EQ(odometry.front().map_T_body.position, way.front().map_T_body.position);
  EXPECT_NE(odometry.back().map_T_body.position, way.back().map_T_body.position);
  for (size_t i = 0; i < way.size(); ++i) {
    EXPECT_EQ(odometry[i].time_ns, way[i].time_ns);
    EXPECT_NEAR((odometry[i].map_T_body.orientation * Eigen::Vector3d::UnitZ()).z(), 1.0, 1e-12);
  }
}

TEST(OdometryDrift, GrowsWithTheRootOfTheWay) {
  // Without turns the error of each axis after d metres has the standard deviation 0.02 sqrt(d).
  DriftOptions options;
  options.drift_rad_per_m = 0.0;
  const std::vector<StampedPose> way = CircleWay(100.0);
  double squares = 0.0;
  constexpr int kSeeds = 60;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    options.seed = static_cast<uint64_t>(seed);
    squares += (AddDrift(way, options).back().map_T_body.position - way.back().map_T_body.position)
                   .squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / (3.0 * kSeeds)), 0.2, 0.04);
}

TEST(OdometryDrift, SaysNothingNewWithoutDrift) {
  const std::vector<StampedPose> way = CircleWay(30.0);
  const std::vector<StampedPose> odometry =
      AddDrift(way, {.drift_m_per_m = 0.0, .drift_rad_per_m = 0.0});
  for (size_t i = 0; i < way.size(); ++i) {
    EXPECT_LT((odometry[i].map_T_body.position - way[i].map_T_body.position).norm(), 1e-9);
  }
}

TEST(DrawLoops, RightOnesSayNearlyTheTruthOfPlacesSeenBefore) {
  const std::vector<StampedPose> way = CircleWay(120.0);
  const std::vector<SimulatedLoop> loops = DrawLoops(way, {});
  ASSERT_GE(loops.size(), 8u);
  TimeNs last_ns = 0;
  for (const SimulatedLoop& loop : loops) {
    EXPECT_TRUE(loop.is_right);
    EXPECT_GE(loop.to_ns - loop.from_ns, 10 * kNsPerSecond);
    EXPECT_GE(loop.to_ns - last_ns, 10 * kNsPerSecond);
    last_ns = loop.to_ns;
    const Pose3d right = Relative(way, loop.from_ns, loop.to_ns);
    EXPECT_LE(right.position.norm(), 2.0);
    EXPECT_LE(AngleBetween(right.orientation, Eigen::Quaterniond::Identity()), 1.048);
    EXPECT_LT((right.position - loop.from_T_to.position).norm(), 5.0 * 0.05);
    EXPECT_LT(AngleBetween(right.orientation, loop.from_T_to.orientation), 5.0 * 0.01745);
  }
}

TEST(DrawLoops, WrongOnesAreAsManyAsAskedAndFarFromTheTruth) {
  const std::vector<StampedPose> way = CircleWay(120.0);
  DriftOptions options;
  options.wrong_share = 0.4;
  size_t wrong_count = 0;
  TimeNs last_ns = 0;
  const std::vector<SimulatedLoop> loops = DrawLoops(way, options);
  for (const SimulatedLoop& loop : loops) {
    EXPECT_GE(loop.to_ns, last_ns);
    last_ns = loop.to_ns;
    if (loop.is_right) continue;
    ++wrong_count;
    const Pose3d right = Relative(way, loop.from_ns, loop.to_ns);
    EXPECT_GE((right.position - loop.from_T_to.position).norm(), 1.0);
  }
  EXPECT_NEAR(static_cast<double>(wrong_count), 0.4 * static_cast<double>(loops.size()), 1.0);
}

TEST(DrawLoops, ARobotThatStandsRecognisesNothing) {
  std::vector<StampedPose> still = CircleWay(60.0);
  for (StampedPose& pose : still) pose.map_T_body = still.front().map_T_body;
  EXPECT_TRUE(DrawLoops(still, {.wrong_share = 0.5}).empty());
  EXPECT_TRUE(DrawLoops({}, {}).empty());
}

TEST(DrawLoops, TheSameSeedGivesTheSameLoops) {
  const std::vector<StampedPose> way = CircleWay(120.0);
  const std::vector<SimulatedLoop> a = DrawLoops(way, {.seed = 4, .wrong_share = 0.3});
  const std::vector<SimulatedLoop> b = DrawLoops(way, {.seed = 4, .wrong_share = 0.3});
  const std::vector<SimulatedLoop> c = DrawLoops(way, {.seed = 5, .wrong_share = 0.3});
  ASSERT_EQ(a.size(), b.size());
  ASSERT_FALSE(a.empty() || c.empty());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].from_T_to.position, b[i].from_T_to.position);
  }
  EXPECT_NE(a.front().from_T_to.position, c.front().from_T_to.position);
}

TEST(DriftOptions, RefuseSharesAndRatesThatAreNone) {
  EXPECT_TRUE(DriftOptions().Validate().ok());
  EXPECT_EQ(ReasonOf(DriftOptions{.wrong_share = 1.0}.Validate()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(DriftOptions{.drift_m_per_m = NAN}.Validate()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::simulator
