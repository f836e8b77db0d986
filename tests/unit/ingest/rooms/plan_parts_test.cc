// SPDX-License-Identifier: Apache-2.0
// Outlines of regions and gaps in walls, on small plans and random ones.
#include <gtest/gtest.h>

#include "ingest/rooms/outline.h"
#include "ingest/rooms/wall_gaps.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/rooms/drawing.h"

namespace dsg::ingest {
namespace {

PlanRegions Blank(int width, int height) {
  PlanRegions regions;
  regions.frame.size = {width, height, 1};
  regions.region_of.assign(static_cast<size_t>(width * height), -1);
  return regions;
}

bool SegmentsTouch(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                   const Eigen::Vector2d& d) {
  const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& r) {
    return (q - p).x() * (r - p).y() - (q - p).y() * (r - p).x();
  };
  return side(a, b, c) * side(a, b, d) < -1e-12 && side(c, d, a) * side(c, d, b) < -1e-12;
}

TEST(Outline, OfARectangleHasFourCorners) {
  PlanRegions regions = Blank(10, 8);
  regions.count = 1;
  for (int y = 2; y < 6; ++y) {
    for (int x = 3; x < 9; ++x) regions.region_of[static_cast<size_t>(y * 10 + x)] = 0;
  }
  const std::vector<Polygon2d> outlines = OutlinesOf(regions);
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_EQ(outlines[0].size(), 4u);
  EXPECT_NEAR(SignedArea(outlines[0]), 0.24, 1e-9);
}

TEST(Outline, OfARandomRegionIsSimpleAndCounterClockwise) {
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed, 0);
    const int width = random.Integer(1, 20);
    const int height = random.Integer(1, 20);
    PlanRegions regions = Blank(width, height);
    regions.count = 1;
    const double fill = random.Uniform(0.3, 0.95);
    for (int& region : regions.region_of) region = random.Chance(fill) ? 0 : -1;
    regions.region_of[0] = 0;
    const Polygon2d outline = OutlinesOf(regions)[0];
    ASSERT_GE(outline.size(), 3u) << "seed " << seed;
    EXPECT_GT(SignedArea(outline), 0.0) << "seed " << seed;
    for (size_t i = 0; i < outline.size(); ++i) {
      for (size_t j = i + 1; j < outline.size(); ++j) {
        EXPECT_FALSE(SegmentsTouch(outline[i], outline[(i + 1) % outline.size()], outline[j],
                                   outline[(j + 1) % outline.size()]))
            << "seed " << seed;
      }
    }
  }
}

TEST(Outline, OfARegionWithoutCellsIsEmpty) {
  PlanRegions regions = Blank(3, 3);
  regions.count = 1;
  EXPECT_TRUE(OutlinesOf(regions)[0].empty());
}

/// Two rooms with a wall across at any angle, and a gap in it.
OccupancyGrid TurnedWall(double angle, double gap_m) {
  OccupancyGrid plan;
  plan.frame.size = {100, 100, 1};
  plan.cells.assign(10000, Occupancy::kFree);
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
  for (int64_t i = 0; i < plan.frame.CellCount(); ++i) {
    const Eigen::Vector2d at = plan.frame.Center(plan.frame.Cell(i)).head<2>();
    const Eigen::Vector2d from = at - Eigen::Vector2d(5.0, 5.0);
    const double off_m = std::abs(from.x() * along.y() - from.y() * along.x());
    const bool is_border = (from.array().abs() > 4.8).any();
    const bool is_wall = off_m < 0.12 && std::abs(from.dot(along)) > 0.5 * gap_m;
    if (is_border || is_wall) plan.cells[static_cast<size_t>(i)] = Occupancy::kOccupied;
  }
  return plan;
}

TEST(WallGaps, AreFoundAtAnyAngle) {
  for (const double gap_m : {0.9, 2.2}) {
    for (int step = 0; step < 12; ++step) {
      const OccupancyGrid plan = TurnedWall(step * 0.26, gap_m);
      const std::vector<WallGap> gaps = FindWallGaps(DistanceField(plan), {});
      ASSERT_EQ(gaps.size(), 1u) << step << " " << gap_m;
      EXPECT_NEAR(gaps[0].WidthM(), gap_m, 0.25);
      EXPECT_LT((gaps[0].MiddleMap() - Eigen::Vector2d(5.0, 5.0)).norm(), 0.2);
    }
  }
}

TEST(WallGaps, AreNoneInACorridor) {
  OccupancyGrid plan;
  plan.frame.size = {200, 30, 1};
  plan.cells.assign(6000, Occupancy::kOccupied);
  for (int y = 5; y < 17; ++y) {
    for (int x = 5; x < 195; ++x) plan.cells[static_cast<size_t>(y * 200 + x)] = Occupancy::kFree;
  }
  EXPECT_TRUE(FindWallGaps(DistanceField(plan), {}).empty());
}

TEST(WallGaps, AreWhereACorridorEndsInAHall) {
  Drawing plan(20, 12);
  plan.Free(0.5, 0.5, 10.5, 11.5).Free(10.5, 5.0, 19.5, 6.6);
  const std::vector<WallGap> gaps = FindWallGaps(DistanceField(plan.plan()), {});
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_NEAR(gaps[0].MiddleMap().x(), 10.5, 0.6);
  // A niche of the hall, and a corridor that crosses another one.
  Drawing niche(20, 12);
  niche.Free(0.5, 0.5, 10.5, 11.5).Free(10.5, 5.0, 12.0, 6.6);
  EXPECT_TRUE(FindWallGaps(DistanceField(niche.plan()), {}).empty());
  Drawing cross(20, 20);
  cross.Free(0.5, 9.0, 19.5, 11.0).Free(9.0, 0.5, 11.0, 19.5);
  EXPECT_TRUE(FindWallGaps(DistanceField(cross.plan()), {}).empty());
}

TEST(Regions, GrowNoFartherThanTheyMay) {
  PlanRegions regions = Blank(20, 1);
  regions.count = 1;
  regions.region_of[0] = 0;
  GrowRegions(std::vector<uint8_t>(20, 1), 0.5, &regions);
  EXPECT_EQ(regions.CellCounts()[0], 6);
}

}  // namespace
}  // namespace dsg::ingest
