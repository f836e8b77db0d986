// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/simplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "schema/base/random.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

constexpr TimeNs kMs = kNsPerSecond / 1000;

TimedPose At(TimeNs time_ns, double x, double y, double yaw_rad = 0.0) {
  TimedPose pose;
  pose.time_ns = time_ns;
  pose.map_T_agent.position = {x, y, 0.0};
  pose.map_T_agent.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

// Somebody who walks, turns, stands, stops being seen, at a rate that changes.
std::vector<TimedPose> RandomTrack(Random* random, size_t count, TimeNs start_ns) {
  std::vector<TimedPose> poses;
  TimeNs time_ns = start_ns;
  double x = 0.0;
  double y = 0.0;
  double heading_rad = 0.0;
  double speed_mps = 1.0;
  uint32_t flags = 0;
  const auto covariance = std::make_shared<const Covariance6>();
  bool has_covariance = false;
  for (size_t i = 0; i < count; ++i) {
    TimeNs step_ns = random->Integer(20, 200) * kMs;
    if (random->Chance(0.01)) step_ns = random->Integer(2'001, 90'000) * kMs;
    if (random->Chance(0.05)) speed_mps = random->Uniform(0.0, 2.0);
    if (random->Chance(0.01)) flags ^= pose_flags::kCorrected;
    if (random->Chance(0.005)) flags ^= pose_flags::kNoOrientation;
    if (random->Chance(0.005)) has_covariance = !has_covariance;
    heading_rad += random->Normal() * 0.1;
    time_ns += step_ns;
    const double step_m = speed_mps * 1e-9 * static_cast<double>(step_ns);
    x += step_m * std::cos(heading_rad);
    y += step_m * std::sin(heading_rad);
    poses.push_back(At(time_ns, x, y, heading_rad));
    poses.back().flags = flags;
    if (has_covariance) poses.back().covariance = covariance;
  }
  return poses;
}

std::set<TimeNs> Dropped(const std::vector<TimedPose>& poses, const SimplifyOptions& options,
                         bool is_whole = true) {
  std::set<TimeNs> dropped;
  TrackThinner thinner(options, [&](const TimedPose& pose) { dropped.insert(pose.time_ns); });
  for (const TimedPose& pose : poses) thinner.Add(pose);
  thinner.Finish(is_whole);
  return dropped;
}

std::vector<TimedPose> Without(const std::vector<TimedPose>& poses,
                               const std::set<TimeNs>& dropped) {
  std::vector<TimedPose> kept;
  for (const TimedPose& pose : poses) {
    if (!dropped.contains(pose.time_ns)) kept.push_back(pose);
  }
  return kept;
}

// Every pose of the full track is told by the kept ones, and every gap is a gap still.
void ExpectTold(const std::vector<TimedPose>& all, const std::vector<TimedPose>& kept,
                const SimplifyOptions& options) {
  const auto later = [](TimeNs t, const TimedPose& pose) { return t < pose.time_ns; };
  for (size_t i = 0; i < all.size(); ++i) {
    const TimedPose& pose = all[i];
    const auto after = std::upper_bound(kept.begin(), kept.end(), pose.time_ns, later);
    ASSERT_NE(after, kept.begin());
    const TimedPose& before = *(after - 1);
    if (before.time_ns == pose.time_ns) continue;
    ASSERT_NE(after, kept.end());
    ASSERT_LE(after->time_ns - before.time_ns, options.gap_ns_max);
    const double fraction = static_cast<double>(pose.time_ns - before.time_ns) /
                            static_cast<double>(after->time_ns - before.time_ns);
    const Pose3d told = Interpolate(before.map_T_agent, after->map_T_agent, fraction);
    ASSERT_LE((told.position - pose.map_T_agent.position).norm(), options.position_m + 1e-12);
    ASSERT_EQ(pose.flags, before.flags);
    ASSERT_EQ(pose.flags, after->flags);
    if ((pose.flags & pose_flags::kNoOrientation) == 0) {
      ASSERT_LE(AngleBetween(told.orientation, pose.map_T_agent.orientation),
                options.rotation_rad + 1e-12);
    }
  }
}

TEST(Simplify, TellsEveryDroppedPoseWithinTheBoundsAndLeavesGapsGaps) {
  const uint64_t seed = test::TestSeed(61);
  for (uint64_t stream = 0; stream < 30; ++stream) {
    SCOPED_TRACE(stream);
    Random random(seed, stream);
    const auto poses = RandomTrack(&random, 3'000, random.Integer(-500, 500) * kNsPerSecond);
    SimplifyOptions options;
    options.position_m = random.Uniform(0.005, 0.3);
    options.rotation_rad = random.Uniform(0.05, 0.5);
    const auto dropped = Dropped(poses, options);
    EXPECT_GT(dropped.size(), poses.size() / 10);
    ExpectTold(poses, Without(poses, dropped), options);
  }
}

TEST(Simplify, DropsNothingOfWhatIsThin) {
  const uint64_t seed = test::TestSeed(62);
  for (uint64_t stream = 0; stream < 20; ++stream) {
    Random random(seed, stream);
    const auto poses = RandomTrack(&random, 3'000, 0);
    const SimplifyOptions options;
    const auto kept = Without(poses, Dropped(poses, options));
    EXPECT_TRUE(Dropped(kept, options).empty());
  }
}

TEST(Simplify, KeepsItsBoundWhenItIsDoneAgainEveryDayWithALaterEnd) {
  const uint64_t seed = test::TestSeed(63);
  Random random(seed, 0);
  const auto all = RandomTrack(&random, 5'000, 0);
  SimplifyOptions options;
  std::vector<TimedPose> left = all;
  for (TimeNs end_ns = 0; end_ns < all.back().time_ns; end_ns += 17 * kNsPerSecond) {
    options.span.to_ns = end_ns;
    left = Without(left, Dropped(left, options, /*is_whole=*/false));
    for (const TimedPose& pose : Without(all, {})) {
      if (pose.time_ns < end_ns) continue;
      // What is younger is not touched.
      ASSERT_TRUE(std::any_of(left.begin(), left.end(), [&](const TimedPose& other) {
        return other.time_ns == pose.time_ns;
      }));
      break;
    }
  }
  options.span = Interval();
  ExpectTold(all, left, options);
  EXPECT_LT(left.size(), all.size() / 2);
}

TEST(Simplify, OfSomebodyWhoWalksStraightKeepsNoMoreThanTheGapAsks) {
  std::vector<TimedPose> poses;
  for (int i = 0; i <= 600; ++i) poses.push_back(At(i * 100 * kMs, 0.1 * i, 0.0));
  const auto kept = Without(poses, Dropped(poses, SimplifyOptions()));
  EXPECT_LE(kept.size(), 32u);
}

TEST(Simplify, KeepsThePosesOnBothSidesOfWhatIsForgotten) {
  std::set<TimeNs> dropped;
  TrackThinner thinner(SimplifyOptions(),
                       [&](const TimedPose& pose) { dropped.insert(pose.time_ns); });
  for (int i = 0; i < 300; ++i) {
    if (i == 150) thinner.Break();
    thinner.Add(At(i * 100 * kMs, 0.1 * i, 0.0));
  }
  thinner.Finish(/*is_whole=*/true);
  EXPECT_GT(dropped.size(), 200u);
  EXPECT_FALSE(dropped.contains(149 * 100 * kMs));
  EXPECT_FALSE(dropped.contains(150 * 100 * kMs));
}

}  // namespace
}  // namespace dsg
