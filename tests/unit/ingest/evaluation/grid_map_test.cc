// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/grid_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/temp_folder.h"

namespace dsg::evaluation {
namespace {

// '#' = obstacle; the first row is the highest.
truth::FreeGrid GridOf(const std::vector<std::string>& rows) {
  truth::FreeGrid grid;
  grid.cell_m = 0.5;
  grid.height = static_cast<int>(rows.size());
  grid.width = static_cast<int>(rows[0].size());
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    for (const char c : *row) {
      grid.cells.push_back(c == '#' ? truth::kCellObserved
                                    : truth::kCellFree | truth::kCellObserved);
    }
  }
  return grid;
}

TEST(DistanceTransform, EqualsTheNearestOfAllCells) {
  std::mt19937_64 random(test::TestSeed(4));
  for (int round = 0; round < 50; ++round) {
    const int width = 1 + static_cast<int>(random() % 20);
    const int height = 1 + static_cast<int>(random() % 20);
    std::vector<uint8_t> is_set;
    for (int i = 0; i < width * height; ++i) is_set.push_back(random() % 15 == 0 ? 1 : 0);
    const std::vector<double> distance = DistanceTransform(is_set, width, height);
    for (int i = 0; i < width * height; ++i) {
      double best = std::numeric_limits<double>::infinity();
      for (int j = 0; j < width * height; ++j) {
        if (is_set[static_cast<size_t>(j)] == 0) continue;
        best = std::min(best, std::hypot(i % width - j % width, i / width - j / width));
      }
      ASSERT_DOUBLE_EQ(distance[static_cast<size_t>(i)], best) << "cell " << i << " of " << width;
    }
  }
}

TEST(GridMap, TakesTheOutsideForAnObstacle) {
  const truth::FreeGrid grid = GridOf({"...", "...", "..."});
  const GridMap map(&grid);
  EXPECT_DOUBLE_EQ(map.ClearanceOf(4), 1.0);
  EXPECT_DOUBLE_EQ(map.ClearanceOf(0), 0.5);
  EXPECT_FALSE(map.CellAt({-0.1, 0.2}).has_value());
  EXPECT_FALSE(map.CellAt({1.5, 0.2}).has_value());
  EXPECT_EQ(*map.CellAt({1.4, 0.6}), 5u);
}

TEST(GridMap, SeesAWallAcrossAWay) {
  const truth::FreeGrid grid = GridOf({".....", "..#..", ".....", "....."});
  const GridMap map(&grid);
  EXPECT_FALSE(map.IsStraightWay({0.2, 1.2}, {2.2, 1.2}, 0.0));
  EXPECT_TRUE(map.IsStraightWay({0.2, 0.7}, {2.2, 0.7}, 0.0));
  EXPECT_FALSE(map.IsStraightWay({0.2, 0.7}, {2.2, 0.7}, 0.6));
  EXPECT_FALSE(map.IsStraightWay({0.2, 0.7}, {1e12, 0.7}, 0.0));
}

TEST(GridMap, FindsTheShortestWayAroundAWall) {
  const truth::FreeGrid grid = GridOf({"#####", "#.#.#", "#.#.#", "#...#", "#####"});
  const GridMap map(&grid);
  const std::vector<double> ways = map.WaysFrom(*map.CellAt({0.75, 1.75}), 0.0);
  // One cell down, two diagonally across the corner cells, one up.
  EXPECT_NEAR(ways[*map.CellAt({1.75, 1.75})], 0.5 * (1 + 2 * std::sqrt(2.0) + 1), 1e-12);
  EXPECT_EQ(ways[0], std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace dsg::evaluation
