// SPDX-License-Identifier: Apache-2.0
// Plans of one cell's height drawn by hand: walls everywhere, rooms cut out of them.
#pragma once

#include <cmath>

#include "ingest/grid/occupancy_grid.h"

namespace dsg::ingest {

inline constexpr double kDrawnCellM = 0.05;

/// Boxes by their low and high corners, metres; all of the plan is wall to begin with.
class Drawing {
 public:
  Drawing(double width_m, double height_m) {
    plan_.frame.cell_m = kDrawnCellM;
    plan_.frame.size = {Cells(width_m), Cells(height_m), 1};
    plan_.cells.assign(static_cast<size_t>(plan_.frame.CellCount()), Occupancy::kOccupied);
  }
  Drawing& Free(double x0, double y0, double x1, double y1) {
    return Fill(x0, y0, x1, y1, Occupancy::kFree);
  }
  Drawing& Wall(double x0, double y0, double x1, double y1) {
    return Fill(x0, y0, x1, y1, Occupancy::kOccupied);
  }
  Drawing& Unseen(double x0, double y0, double x1, double y1) {
    return Fill(x0, y0, x1, y1, Occupancy::kUnknown);
  }

  const OccupancyGrid& plan() const { return plan_; }
  Occupancy At(double x, double y) const { return plan_.At(CellOf(x, y)); }
  Eigen::Vector3i CellOf(double x, double y) const {
    return plan_.frame.CellOf({x, y, 0.5 * kDrawnCellM});
  }

 private:
  static int Cells(double metres) { return static_cast<int>(std::lround(metres / kDrawnCellM)); }
  Drawing& Fill(double x0, double y0, double x1, double y1, Occupancy state) {
    for (int y = Cells(y0); y < Cells(y1); ++y) {
      for (int x = Cells(x0); x < Cells(x1); ++x) {
        plan_.cells[static_cast<size_t>(plan_.frame.Index({x, y, 0}))] = state;
      }
    }
    return *this;
  }

  OccupancyGrid plan_;
};

}  // namespace dsg::ingest
