// SPDX-License-Identifier: Apache-2.0
// Nearby obstacles are those that an exact search finds, and lines bend away from them.
#include "ingest/simulator/motion/floor_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

TEST(NearbyObstacles, AgreeWithTheExactClearance) {
  const uint64_t seed = 5;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  FreeSpace free_space;
  for (int i = 0; i < 60; ++i) {
    const Point low(random.Uniform(-9, 20), random.Uniform(-9, 20));
    free_space.Add(Rect(low, low + Point(random.Uniform(0.1, 2), random.Uniform(0.1, 2))));
  }
  const NearbyObstacles nearby(free_space, 0.8);
  for (int i = 0; i < 5000; ++i) {
    const Point point(random.Uniform(-12, 25), random.Uniform(-12, 25));
    EXPECT_NEAR(nearby.Clearance(point), std::min(0.8, free_space.Clearance(point)), 1e-12);
  }
}

TEST(NearbyObstacles, PushAwayByWhatIsLacking) {
  FreeSpace free_space({Rect(Point(0, 0), Point(1, 1))});
  const NearbyObstacles nearby(free_space, 0.8);
  EXPECT_LT((nearby.Push(Point(1.2, 0.5), 0.5) - Point(0.3, 0.0)).norm(), 1e-12);
  EXPECT_EQ(nearby.Push(Point(1.6, 0.5), 0.5), Point(0, 0));
  EXPECT_EQ(nearby.Push(Point(50, 50), 0.5), Point(0, 0));
  free_space.Add(Rect(Point(1.4, 0), Point(2, 1)));
  // In the middle of a gap the two sides cancel.
  EXPECT_LT(NearbyObstacles(free_space, 0.8).Push(Point(1.2, 0.5), 0.5).norm(), 1e-12);
}

TEST(NearbyObstacles, OfAnEmptyFloorAreNone) {
  const NearbyObstacles nearby(FreeSpace(), 0.8);
  EXPECT_EQ(nearby.Clearance(Point(0, 0)), 0.8);
  EXPECT_EQ(nearby.Push(Point(0, 0), 0.5), Point(0, 0));
}

TEST(BendLine, KeepsItsEndsAndRoundsCorners) {
  const NearbyObstacles nothing(FreeSpace(), 0.8);
  const Path path({Point(0, 0), Point(3, 0), Point(3, 3)});
  const std::vector<Point> line = BendLine(path, nothing);
  EXPECT_EQ(line.front(), Point(0, 0));
  EXPECT_EQ(line.back(), Point(3, 3));
  for (size_t i = 1; i + 1 < line.size(); ++i) {
    const Point in = line[i] - line[i - 1];
    const Point out = line[i + 1] - line[i];
    EXPECT_LT(std::acos(std::min(1.0, in.normalized().dot(out.normalized()))), 0.12);
  }
}

TEST(BendLine, GoesThroughTheMiddleOfADoorAndNotThroughItsFrame) {
  // A wall with a door of 0.9 m, crossed near one side of it.
  const FreeSpace free_space(
      {Rect(Point(-5, -0.075), Point(0, 0.075)), Rect(Point(0.9, -0.075), Point(6, 0.075))});
  const NearbyObstacles nearby(free_space, 0.8);
  const Path path({Point(-2, -2), Point(0.32, 0), Point(2, 2)});
  const std::vector<Point> line = BendLine(path, nearby);
  EXPECT_GE(LineClearance(line, nearby), 0.4);
  EXPECT_EQ(line.front(), Point(-2, -2));
  EXPECT_EQ(line.back(), Point(2, 2));
}

TEST(BendLine, KeepsClearInAPassageAsWideAsAWalkerNeeds) {
  // Two desks staggered so that the way between them bends; 0.6 m everywhere.
  const FreeSpace free_space({Rect(Point(0, 0.3), Point(2, 3)),
                              Rect(Point(0, -3), Point(2.6, -0.3)),
                              Rect(Point(2.6, -3), Point(6, 3.3))});
  const NearbyObstacles nearby(free_space, 0.8);
  const Path path({Point(-1, 0), Point(2.3, 0), Point(2.3, 4)});
  EXPECT_GE(LineClearance(BendLine(path, nearby), nearby), 0.28);
}

TEST(BendLine, OfAPathWithoutLengthIsAPoint) {
  const NearbyObstacles nothing(FreeSpace(), 0.8);
  EXPECT_EQ(BendLine(Path({Point(1, 2)}), nothing), std::vector<Point>{Point(1, 2)});
}

}  // namespace
}  // namespace dsg::simulator
