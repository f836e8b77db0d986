// SPDX-License-Identifier: Apache-2.0
#include "ingest/grid/line_walk.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

std::vector<int64_t> CellsOn(const GridFrame& frame, const Eigen::Vector3d& from,
                             const Eigen::Vector3d& to) {
  std::vector<int64_t> cells;
  WalkLine(frame, from, to, [&](const Eigen::Vector3i& cell, double, double) {
    cells.push_back(frame.Index(cell));
    return true;
  });
  return cells;
}

TEST(LineWalk, PassesEveryCellThatHoldsAPointOfTheLine) {
  Random random(1, 0);
  GridFrame frame;
  frame.size = {20, 15, 10};
  for (int i = 0; i < 2000; ++i) {
    const auto draw = [&](double low, double high) {
      return Eigen::Vector3d(random.Uniform(low, high), random.Uniform(low, high),
                             random.Uniform(low, high));
    };
    const Eigen::Vector3d from = draw(-1.0, 3.0);
    const Eigen::Vector3d to = draw(-1.0, 3.0);
    const std::vector<int64_t> cells = CellsOn(frame, from, to);
    const std::set<int64_t> known(cells.begin(), cells.end());
    EXPECT_EQ(known.size(), cells.size()) << "each cell once";
    for (int step = 0; step <= 1000; ++step) {
      const Eigen::Vector3i cell = frame.CellOf(from + (to - from) * step / 1000.0);
      if (frame.Holds(cell)) {
        ASSERT_TRUE(known.count(frame.Index(cell)) != 0);
      }
    }
  }
}

TEST(LineWalk, GoesStraightAlongAnAxisAndStaysOnAPoint) {
  GridFrame frame;
  frame.size = {10, 10, 10};
  EXPECT_EQ(CellsOn(frame, {0.05, 0.55, 0.55}, {0.95, 0.55, 0.55}).size(), 10u);
  EXPECT_EQ(CellsOn(frame, {0.95, 0.55, 0.55}, {0.05, 0.55, 0.55}).size(), 10u);
  EXPECT_EQ(CellsOn(frame, {0.55, 0.55, 0.55}, {0.55, 0.55, 0.55}).size(), 1u);
  EXPECT_TRUE(CellsOn(frame, {-1.0, -1.0, 0.5}, {-1.0, 3.0, 0.5}).empty());
  EXPECT_TRUE(CellsOn(GridFrame(), {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}).empty());
}

TEST(LineWalk, StopsWhenTold) {
  GridFrame frame;
  frame.size = {10, 1, 1};
  int count = 0;
  const bool is_done =
      WalkLine(frame, {0.05, 0.05, 0.05}, {0.95, 0.05, 0.05},
               [&](const Eigen::Vector3i&, double, double) { return ++count < 3; });
  EXPECT_FALSE(is_done);
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace dsg::ingest
