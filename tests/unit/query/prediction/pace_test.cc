// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/route.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/random.h"

namespace dsg::query {
namespace {

constexpr TimeNs kStepNs = 400'000'000;

/// Steps along x, metres per step of 0.4 s.
std::vector<PathPoint> Steps(const std::vector<double>& steps_m) {
  std::vector<PathPoint> path = {{0, Eigen::Vector3d::Zero()}};
  for (const double step_m : steps_m) {
    path.push_back({path.back().time_ns + kStepNs,
                    path.back().position_map + Eigen::Vector3d(step_m, 0.0, 0.0)});
  }
  return path;
}

TEST(Pace, StaysEvenWhileStepsAreAlike) {
  for (const std::vector<double>& steps_m :
       {std::vector<double>{}, {0.4}, {0.2, 0.4}, {0.4, 0.4, 0.4}, {0.4, 0.44, 0.4}}) {
    const Pace pace = PaceOf(Steps(steps_m), 1.0, {});
    EXPECT_EQ(pace.SpeedAt(7.0), 1.0);
    EXPECT_EQ(pace.WayM(7.0), 7.0);
  }
}

TEST(Pace, ComesToRestWhenSlowingDown) {
  // 1.2, 1.2, 0.92 m/s: 0.7 m/s2 since a step ago, hence 0.78 m/s now.
  const Pace pace = PaceOf(Steps({0.48, 0.48, 0.368}), 0.92, {});
  EXPECT_NEAR(pace.speed_m_s, 0.78, 1e-9);
  EXPECT_EQ(pace.SpeedAt(2.0), 0.0);
  EXPECT_NEAR(pace.WayM(10.0), 0.78 * 0.78 / 1.4, 1e-9);
}

TEST(Pace, ReachesThePaceOfAWalkWhenSettingOut) {
  const Pace pace = PaceOf(Steps({0.0, 0.04, 0.16}), 0.4, {});
  EXPECT_NEAR(pace.SpeedAt(0.0), 0.55, 1e-9);
  EXPECT_EQ(pace.SpeedAt(5.0), GoalOptions().walking_m_s);
  EXPECT_LT(pace.WayM(5.0), 5.0 * GoalOptions().walking_m_s);
  GoalOptions nobody;
  nobody.walking_m_s = 0.0;
  EXPECT_EQ(PaceOf(Steps({0.0, 0.04, 0.16}), 0.4, nobody).SpeedAt(5.0), 0.4);
}

TEST(Pace, TakesAShortStepAroundACornerForNoStop) {
  std::vector<PathPoint> path = Steps({0.48, 0.48});
  path.push_back({3 * kStepNs, path.back().position_map + Eigen::Vector3d(0.25, 0.25, 0.0)});
  EXPECT_EQ(PaceOf(path, 0.9, {}).SpeedAt(5.0), 0.9);
}

TEST(Pace, WalksAsFarAsItsSpeedsAddUpTo) {
  constexpr uint64_t kSeed = 3;
  Random random(kSeed, 0);
  for (int round = 0; round < 200; ++round) {
    const Pace pace{random.Uniform(0.0, 2.0), random.Chance(0.5) ? 0.0 : random.Uniform(0.0, 2.0),
                    random.Uniform(0.3, 1.5)};
    double way_m = 0.0;
    constexpr double kPartS = 1e-3;
    for (int i = 0; i < 5000; ++i) way_m += kPartS * pace.SpeedAt((i + 0.5) * kPartS);
    EXPECT_NEAR(pace.WayM(5.0), way_m, 1e-4) << "seed " << kSeed << ", round " << round;
  }
}

}  // namespace
}  // namespace dsg::query
