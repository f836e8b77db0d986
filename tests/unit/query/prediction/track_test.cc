// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/velocity.h"

#include <gtest/gtest.h>

#include "tests/unit/query/prediction/path_points.h"

namespace dsg::query {
namespace {

constexpr TimeNs kGapNs = 1'500'000'000;

std::vector<PathPoint> Walk(double from_s, double to_s, double step_s) {
  std::vector<PathPoint> poses;
  for (int i = 0; from_s + i * step_s <= to_s + 1e-9; ++i) {
    poses.push_back(At(from_s + i * step_s, from_s + i * step_s));
  }
  return poses;
}

TEST(RecentTrack, IsEvenWhateverTheRateOfPoses) {
  for (const double step_s : {0.033, 0.2, 0.7, 1.3}) {
    const std::vector<PathPoint> poses = Walk(0.0, 20.0, step_s);
    const std::vector<PathPoint> points = RecentTrack(poses, kGapNs);
    ASSERT_EQ(points.size(), 21u) << step_s;
    EXPECT_EQ(points.back().time_ns, poses.back().time_ns);
    for (size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(points[i].position_map.x(), static_cast<double>(points[i].time_ns) * 1e-9, 1e-6);
      if (i > 0) {
        EXPECT_EQ(points[i].time_ns - points[i - 1].time_ns, kTrackStepNs);
      }
    }
  }
}

TEST(RecentTrack, ForgetsWhatWasBeforeAGap) {
  std::vector<PathPoint> poses = Walk(0.0, 5.0, 0.2);
  for (const PathPoint& pose : Walk(7.0, 8.0, 0.2)) poses.push_back(pose);
  const std::vector<PathPoint> points = RecentTrack(poses, kGapNs);
  ASSERT_EQ(points.size(), 3u);
  EXPECT_GE(points.front().time_ns, At(7.0, 0).time_ns);
}

TEST(RecentTrack, TakesAShorterStepOnlyIfThereIsNoLongerOne) {
  EXPECT_EQ(RecentTrack({}, kGapNs).size(), 0u);
  EXPECT_EQ(RecentTrack({At(1, 1)}, kGapNs).size(), 1u);
  EXPECT_EQ(RecentTrack({At(1, 1), At(1.1, 1.1)}, kGapNs).size(), 1u);
  const std::vector<PathPoint> points = RecentTrack({At(1, 1), At(1.3, 1.3)}, kGapNs);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points.front().time_ns, At(1, 1).time_ns);
}

}  // namespace
}  // namespace dsg::query
