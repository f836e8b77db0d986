// SPDX-License-Identifier: Apache-2.0
// Rounded lines stay near their legs, and speed profiles invert.
#include "ingest/simulator/world/path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

double DistanceToLine(const Point& point, const std::vector<Point>& line) {
  double nearest = 1e9;
  for (size_t i = 1; i < line.size(); ++i) {
    const Point step = line[i] - line[i - 1];
    const double along = std::clamp((point - line[i - 1]).dot(step) / step.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (point - line[i - 1] - along * step).norm());
  }
  return nearest;
}

TEST(Path, CornersStayWithinAQuarterOfTheCut) {
  const uint64_t seed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  for (int round = 0; round < 200; ++round) {
    std::vector<Point> line;
    for (int i = 0; i < 6; ++i) line.emplace_back(random.Uniform(0, 8), random.Uniform(0, 8));
    const Path path(line);
    for (const Point& point : path.points()) {
      EXPECT_LE(DistanceToLine(point, line), 0.25 * Path::kCornerM + 1e-9);
    }
    EXPECT_EQ(path.At(0.0), line.front());
    EXPECT_EQ(path.At(path.length_m()), line.back());
  }
}

TEST(Path, IsParametrisedByDistance) {
  const Path path({Point(0, 0), Point(4, 0), Point(4, 3)});
  for (double s = 0.0; s + 0.1 < path.length_m(); s += 0.1) {
    const double chord = (path.At(s + 0.1) - path.At(s)).norm();
    EXPECT_LE(chord, 0.1 + 1e-9);
    EXPECT_GE(chord, 0.095);
  }
  EXPECT_NEAR(path.HeadingAt(1.0), 0.0, 1e-12);
  EXPECT_NEAR(path.HeadingAt(path.length_m()), 0.5 * std::numbers::pi, 1e-12);
}

TEST(Path, AcceptsOnePointAndRepeatedPoints) {
  EXPECT_EQ(Path({Point(1, 2)}).length_m(), 0.0);
  EXPECT_EQ(Path({Point(1, 2)}).At(5.0), Point(1, 2));
  const Path path({Point(0, 0), Point(0, 0), Point(2, 0), Point(2, 0)});
  EXPECT_DOUBLE_EQ(path.length_m(), 2.0);
  EXPECT_NEAR(path.At(1.0).x(), 1.0, 1e-12);
}

TEST(SpeedProfile, InvertsAndNeverExceedsItsSpeed) {
  for (const double length : {0.0, 0.3, 1.0, 2.5, 40.0}) {
    const SpeedProfile profile(length, 1.2, 0.7);
    EXPECT_DOUBLE_EQ(profile.DistanceAt(profile.duration_s()), length);
    EXPECT_DOUBLE_EQ(profile.DistanceAt(-1.0), 0.0);
    constexpr double kStep = 0.01;
    for (double t = 0.0; t < profile.duration_s(); t += kStep) {
      const double s = profile.DistanceAt(t);
      EXPECT_NEAR(profile.TimeAt(s), t, 1e-6);
      const double speed = (profile.DistanceAt(t + kStep) - s) / kStep;
      EXPECT_GE(speed, 0.0);
      EXPECT_LE(speed, 1.2 + 1e-9);
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
