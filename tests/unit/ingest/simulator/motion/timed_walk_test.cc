// SPDX-License-Identifier: Apache-2.0
// Walks keep to their line and their limits, whatever the line.
#include "ingest/simulator/motion/timed_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

std::vector<Point> Arc(double radius, double angle) {
  std::vector<Point> line;
  for (int i = 0; i <= 100; ++i) {
    const double at = angle * i / 100;
    line.push_back(radius * Point(std::sin(at), 1.0 - std::cos(at)));
  }
  return line;
}

TEST(TimedWalk, GoesFromStandstillToStandstill) {
  const TimedWalk walk({Point(1, 2), Point(5, 2)}, {0.8, 0.5, 0.9});
  // 4 m at 0.8 m/s, and 0.8 / 0.5 s for speeding up and braking.
  EXPECT_NEAR(walk.duration_s(), 5.0 + 1.6, 0.01);
  EXPECT_EQ(walk.PositionAt(-1.0), Point(1, 2));
  EXPECT_EQ(walk.PositionAt(walk.duration_s() + 1.0), Point(5, 2));
  EXPECT_NEAR(walk.PositionAt(0.4).x(), 1.0 + 0.5 * 0.5 * 0.16, 1e-9);
  EXPECT_NEAR(walk.PositionAt(0.5 * walk.duration_s()).x(), 3.0, 1e-9);
  EXPECT_EQ(walk.HeadingAt(3.0), 0.0);
}

TEST(TimedWalk, NeverExceedsItsSpeedNorTurnsTooFast) {
  for (const double radius : {0.3, 1.0, 3.0}) {
    const WalkLimits limits{1.0, 0.6, 0.8};
    const TimedWalk walk(Arc(radius, 3.0), limits);
    const double h = 0.02;
    for (double t = 0.0; t + h < walk.duration_s(); t += h) {
      const double speed = (walk.PositionAt(t + h) - walk.PositionAt(t)).norm() / h;
      const double turn = (walk.HeadingAt(t + h) - walk.HeadingAt(t)) / h;
      EXPECT_LE(speed, limits.speed_m_s + 1e-9);
      EXPECT_LE(speed * speed / radius, 1.05 * limits.acceleration_m_s2);
      EXPECT_LE(std::abs(turn), limits.turn_rad_s + 1e-9);
    }
  }
}

TEST(TimedWalk, HeadingsDoNotJumpByATurn) {
  // Twice around.
  const TimedWalk walk(Arc(1.0, 4.0 * std::numbers::pi), {0.5, 0.5, 0.9});
  EXPECT_NEAR(walk.HeadingAt(walk.duration_s()) - walk.HeadingAt(0.0), 4.0 * std::numbers::pi, 0.4);
}

TEST(TimedWalk, AcceptsLinesWithoutLength) {
  for (const std::vector<Point>& line :
       {std::vector<Point>{Point(1, 1)}, std::vector<Point>{Point(1, 1), Point(1, 1)}}) {
    const TimedWalk walk(line, {});
    EXPECT_EQ(walk.duration_s(), 0.0);
    EXPECT_EQ(walk.length_m(), 0.0);
    EXPECT_EQ(walk.PositionAt(1.0), Point(1, 1));
    EXPECT_EQ(walk.HeadingAt(1.0), 0.0);
  }
}

TEST(TimedWalk, AcceptsTheShortestOfSteps) {
  for (const double length : {1e-6, 0.01, 0.05, 0.06, 0.1, 0.11}) {
    const TimedWalk walk({Point(0, 0), Point(length, 0)}, {1.0, 0.6, 0.9});
    EXPECT_NEAR(walk.length_m(), length, 1e-12);
    EXPECT_GE(walk.duration_s(), 2.0 * std::sqrt(length / 0.6) - 1e-9);
    double last = 0.0;
    for (double t = 0.0; t < walk.duration_s(); t += 0.01) {
      EXPECT_GE(walk.PositionAt(t).x(), last);
      EXPECT_LE(walk.PositionAt(t).x(), length + 1e-12);
      last = walk.PositionAt(t).x();
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
