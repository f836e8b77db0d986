// SPDX-License-Identifier: Apache-2.0
#include "ingest/grid/distance_field.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "ingest/grid/distance_transform.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

OccupancyGrid MakeGrid(const Eigen::Vector3i& size, Occupancy with) {
  OccupancyGrid grid;
  grid.frame.size = size;
  grid.frame.origin_map = Eigen::Vector3d(-0.5, 0.3, -0.1);
  grid.cells.assign(grid.frame.CellCount(), with);
  return grid;
}

OccupancyGrid RandomGrid(const Eigen::Vector3i& size, double occupied_share, Random* random) {
  OccupancyGrid grid = MakeGrid(size, Occupancy::kFree);
  for (Occupancy& cell : grid.cells) {
    if (random->Chance(0.1)) cell = Occupancy::kUnknown;
    if (random->Chance(occupied_share)) cell = Occupancy::kOccupied;
  }
  return grid;
}

// Squared distance and index of the nearest occupied cell, by looking at all of them.
std::pair<int64_t, int64_t> LookAtAll(const OccupancyGrid& grid, int64_t index) {
  std::pair<int64_t, int64_t> best(std::numeric_limits<int64_t>::max(), -1);
  for (int64_t i = 0; i < grid.frame.CellCount(); ++i) {
    if (grid.cells[i] != Occupancy::kOccupied) continue;
    const int64_t squared = (grid.frame.Cell(i) - grid.frame.Cell(index)).squaredNorm();
    if (squared < best.first) best = {squared, i};
  }
  return best;
}

TEST(DistanceTransform, AgreesWithLookingAtAllObstaclesAndTakesTheLowestOfTies) {
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    const Eigen::Vector3i size(random.Integer(1, 14), random.Integer(1, 14), random.Integer(1, 9));
    const OccupancyGrid grid = RandomGrid(size, random.Uniform(0.0, 0.15), &random);
    const ObstacleDistances found = MeasureObstacles(grid, 2);
    for (int64_t i = 0; i < grid.frame.CellCount(); ++i) {
      const auto [squared, nearest] = LookAtAll(grid, i);
      ASSERT_EQ(found.nearest[i], nearest) << "cell " << i;
      const bool is_far = nearest < 0;
      ASSERT_EQ(found.squared_cells[i], is_far ? ObstacleDistances::kFarSquared : squared);
    }
  }
}

TEST(DistanceTransform, DoesNotDependOnTheNumberOfThreads) {
  Random random(3, 0);
  const OccupancyGrid grid = RandomGrid({37, 29, 11}, 0.02, &random);
  const ObstacleDistances one = MeasureObstacles(grid, 1);
  for (const int thread_count : {2, 3, 64}) {
    const ObstacleDistances more = MeasureObstacles(grid, thread_count);
    EXPECT_EQ(one.nearest, more.nearest);
    EXPECT_EQ(one.squared_cells, more.squared_cells);
  }
}

TEST(DistanceField, IsFarEverywhereWithoutObstacles) {
  const DistanceField field(MakeGrid({5, 4, 3}, Occupancy::kFree));
  EXPECT_EQ(field.DistanceM(7), DistanceField::kFarM);
  EXPECT_EQ(field.NearestObstacle(7), -1);
  EXPECT_GT(field.ClearanceM({-0.2, 0.5, 0.0}), 100.0);
}

TEST(DistanceField, TakesAGridThatIsTooLargeOrShortOfCellsWithoutACrash) {
  OccupancyGrid grid;
  grid.frame.size = {1 << 20, 1 << 20, 1 << 20};
  EXPECT_EQ(DistanceField(grid).frame().CellCount(), 0);
  grid.frame.size = {-4, 3, 3};
  EXPECT_EQ(DistanceField(grid).frame().CellCount(), 0);
  grid.frame.size = {4, 3, 3};
  const DistanceField field(grid);
  EXPECT_EQ(field.ClearanceM({0.05, 0.05, 0.05}), 0.0);
  EXPECT_EQ(DistanceField().ClearanceM({0.0, 0.0, 0.0}), 0.0);
}

class Wall : public testing::Test {
 protected:
  // 4 m x 2 m x 1 m, with a wall across at x = 2 m that has a hole of 0.4 m at y = 1 m.
  Wall() {
    OccupancyGrid grid;
    grid.frame.size = {40, 20, 10};
    grid.cells.assign(grid.frame.CellCount(), Occupancy::kFree);
    for (int z = 0; z < 10; ++z) {
      for (int y = 0; y < 20; ++y) {
        if (y >= 8 && y < 12) continue;
        grid.cells[grid.frame.Index({20, y, z})] = Occupancy::kOccupied;
      }
    }
    grid.cells[grid.frame.Index({5, 5, 5})] = Occupancy::kUnknown;
    field_ = DistanceField(grid);
  }
  DistanceField field_;
};

TEST_F(Wall, HasItsClearanceBesideIt) {
  EXPECT_NEAR(field_.ClearanceM({1.05, 0.25, 0.55}), 1.0 - 0.05, 1e-6);
  EXPECT_EQ(field_.ClearanceM({2.05, 0.25, 0.55}), 0.0);
  EXPECT_EQ(field_.ClearanceM({0.55, 0.55, 0.55}), 0.0) << "unknown";
  EXPECT_EQ(field_.ClearanceM({9.0, 0.55, 0.55}), 0.0) << "outside";
  EXPECT_EQ(field_.ClearanceM({std::nan(""), 0.55, 0.55}), 0.0);
  EXPECT_EQ(field_.ClearanceM({1e300, 0.55, 0.55}), 0.0);
}

TEST_F(Wall, IsCrossedThroughItsHoleOnly) {
  EXPECT_EQ(field_.SegmentClearanceM({1.05, 0.35, 0.55}, {3.05, 0.35, 0.55}), 0.0);
  EXPECT_NEAR(field_.SegmentClearanceM({1.05, 0.95, 0.55}, {3.05, 0.95, 0.55}), 0.15, 1e-6);
  EXPECT_TRUE(field_.HasClearance({1.05, 0.95, 0.55}, {3.05, 0.95, 0.55}, 0.14));
  EXPECT_FALSE(field_.HasClearance({1.05, 0.95, 0.55}, {3.05, 0.95, 0.55}, 0.16));
  EXPECT_EQ(field_.SegmentClearanceM({0.15, 0.55, 0.55}, {1.05, 0.55, 0.55}), 0.0)
      << "over a cell that was never seen";
  EXPECT_EQ(field_.SegmentClearanceM({1.05, 0.95, 0.55}, {7.0, 0.95, 0.55}), 0.0)
      << "out of the grid";
}

TEST_F(Wall, HidesWhatIsBehindIt) {
  EXPECT_FALSE(field_.HasLineOfSight({1.05, 0.35, 0.55}, {3.05, 0.35, 0.55}, 0.3));
  EXPECT_TRUE(field_.HasLineOfSight({1.05, 0.95, 0.55}, {3.05, 0.95, 0.55}, 0.0));
  EXPECT_TRUE(field_.HasLineOfSight({0.15, 0.55, 0.55}, {1.05, 0.55, 0.55}, 0.0))
      << "the unknown hides nothing";
  EXPECT_TRUE(field_.HasLineOfSight({1.05, 0.35, 0.55}, {2.05, 0.35, 0.55}, 0.2))
      << "an end in the wall";
  EXPECT_TRUE(field_.HasLineOfSight({-5.0, 0.35, 0.55}, {1.05, 0.35, 0.55}, 0.0));
  EXPECT_FALSE(field_.HasLineOfSight({std::nan(""), 0.0, 0.0}, {1.05, 0.35, 0.55}, 0.0));
}

TEST(DistanceField, NeverSaysMoreThanDensePointsOfTheSegment) {
  Random random(5, 0);
  const OccupancyGrid grid = RandomGrid({30, 30, 8}, 0.01, &random);
  const DistanceField field(grid);
  const Eigen::Vector3d extent = 0.1 * grid.frame.size.cast<double>();
  for (int i = 0; i < 2000; ++i) {
    Eigen::Vector3d ends[2];
    for (Eigen::Vector3d& end : ends) {
      for (int axis = 0; axis < 3; ++axis) end[axis] = random.Uniform(0.0, extent[axis]);
      end += grid.frame.origin_map;
    }
    double least = 1e9;
    for (int step = 0; step <= 400; ++step) {
      const Eigen::Vector3d at = ends[0] + (ends[1] - ends[0]) * step / 400.0;
      least = std::min(least, field.ClearanceM(at));
    }
    ASSERT_LE(field.SegmentClearanceM(ends[0], ends[1]), least + 1e-9);
  }
}

TEST(DistanceField, MeasuresAWholeBuilding) {
  Random random(9, 0);
  OccupancyGrid grid = MakeGrid({650, 650, 30}, Occupancy::kFree);
  for (int i = 0; i < 200'000; ++i) {
    grid.cells[random.Index(static_cast<int>(grid.frame.CellCount()))] = Occupancy::kOccupied;
  }
  const auto begin = std::chrono::steady_clock::now();
  const DistanceField field(std::move(grid));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("650 x 650 x 30 cells in %.2f s\n", took.count());
  EXPECT_GE(field.NearestObstacle(0), 0);
}

}  // namespace
}  // namespace dsg::ingest
