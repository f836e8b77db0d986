// SPDX-License-Identifier: Apache-2.0
// Distances are right because their answers prove it: a plane between the two nearest points keeps
// both sets apart, so that nothing can be nearer.
#include "query/engine/collision/shapes.h"

#include <gtest/gtest.h>

#include "schema/base/random.h"
#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;

constexpr double kExactM = 1e-9;

Vector3d RandomPoint(Random* random, double range_m) {
  return {random->Uniform(-range_m, range_m), random->Uniform(-range_m, range_m),
          random->Uniform(-range_m, range_m)};
}

// On a grid, so that sets are often parallel, degenerate or touch exactly.
Vector3d GridPoint(Random* random, bool coarse) {
  const Vector3d point = RandomPoint(random, 1.5);
  return coarse ? Vector3d(point.array().round()) : point;
}

Convex RandomSet(Random* random, bool coarse) {
  switch (random->Index(4)) {
    case 0:
      return MakePoint(GridPoint(random, coarse));
    case 1:
      return MakeSegment(GridPoint(random, coarse), GridPoint(random, coarse));
    case 2:
      return MakeTriangle(GridPoint(random, coarse), GridPoint(random, coarse),
                          GridPoint(random, coarse));
    default: {
      Pose3d pose = test::RandomPose(random, 1.5);
      if (coarse) pose.orientation.setIdentity();
      if (coarse) pose.position = pose.position.array().round();
      return MakeBox(pose, test::RandomBox(random));
    }
  }
}

// No corner of a set is on the far side of the plane through `point`.
void ExpectBehind(const Convex& set, const Vector3d& point, const Vector3d& normal) {
  for (int i = 0; i < set.corner_count; ++i) {
    EXPECT_LE(normal.dot(set.corners[static_cast<size_t>(i)] - point), 1e-7);
  }
}

TEST(Convex, DistancesAreProvenByThePlaneBetween) {
  Random random(test::TestSeed(1), 0);
  int touching_count = 0;
  constexpr int kPairCount = 40'000;
  for (int i = 0; i < kPairCount; ++i) {
    const bool coarse = i % 2 == 0;
    const Convex a = RandomSet(&random, coarse);
    const Convex b = RandomSet(&random, coarse);
    SCOPED_TRACE(testing::Message() << i << ": " << a.corner_count << " " << b.corner_count);
    const ClosestPair pair = Distance(a, b);
    EXPECT_LT((NearestPoint(a, pair.on_first) - pair.on_first).norm(), kExactM);
    EXPECT_LT((NearestPoint(b, pair.on_second) - pair.on_second).norm(), kExactM);
    EXPECT_NEAR((pair.on_first - pair.on_second).norm(), pair.distance_m, kExactM);
    touching_count += pair.distance_m == 0.0 ? 1 : 0;
    if (pair.distance_m < 1e-6) continue;
    const Vector3d normal = (pair.on_second - pair.on_first) / pair.distance_m;
    ExpectBehind(a, pair.on_first, normal);
    ExpectBehind(b, pair.on_second, -normal);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(touching_count, kPairCount / 20);
}

TEST(Convex, ASetWithinAnotherTouchesIt) {
  const Convex box = MakeBox(Pose3d(), Box3d(Vector3d(-1, -1, -1), Vector3d(1, 1, 1)));
  EXPECT_EQ(Distance(MakePoint({0.1, 0, 0}), box).distance_m, 0.0);
  EXPECT_EQ(Distance(box, MakeSegment({0, 0, 0}, {0.5, 0, 0})).distance_m, 0.0);
  EXPECT_EQ(Distance(MakeTriangle({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}), box).distance_m, 0.0);
  EXPECT_EQ(Distance(box, MakeBox({{0.2, 0, 0}, Eigen::Quaterniond(0, 1, 0, 0)},
                                  Box3d(Vector3d(-.1, -.1, -.1), Vector3d(.1, .1, .1))))
                .distance_m,
            0.0);
}

TEST(Convex, CrossingWithoutACornerInsideIsTouching) {
  const Convex triangle = MakeTriangle({-1, -1, 0}, {1, -1, 0}, {0, 2, 0});
  EXPECT_EQ(Distance(MakeSegment({0, 0, -1}, {0, 0, 1}), triangle).distance_m, 0.0);
  const Convex beam = MakeBox(Pose3d(), Box3d(Vector3d(-9, -.1, -.1), Vector3d(9, .1, .1)));
  EXPECT_EQ(Distance(beam, MakeTriangle({0, -5, -5}, {0, 5, -5}, {0, 0, 5})).distance_m, 0.0);
}

TEST(Convex, FirstWithinIsWhereTheDistanceBecomesTheReach) {
  Random random(test::TestSeed(2), 0);
  int found_count = 0;
  for (int i = 0; i < 8000; ++i) {
    const Convex set = RandomSet(&random, i % 2 == 0);
    const Vector3d from = RandomPoint(&random, 3.0);
    const Vector3d to = RandomPoint(&random, 3.0);
    const double reach_m = random.Uniform(0.01, 0.5);
    if (Distance(MakeSegment(from, to), set).distance_m > reach_m) continue;
    ++found_count;
    const double first = FirstWithin(set, from, to, reach_m);
    const Vector3d there = from + first * (to - from);
    const double distance_m = (NearestPoint(set, there) - there).norm();
    EXPECT_LE(distance_m, reach_m + kExactM);
    if (first > 0.0) {
      EXPECT_NEAR(distance_m, reach_m, 1e-7);
    }
    for (double earlier = 0.0; earlier < first - 1e-9; earlier += 0.01) {
      const Vector3d point = from + earlier * (to - from);
      EXPECT_GE((NearestPoint(set, point) - point).norm(), reach_m);
    }
  }
  EXPECT_GT(found_count, 300);
}

}  // namespace
}  // namespace dsg::query
