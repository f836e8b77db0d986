// SPDX-License-Identifier: Apache-2.0
// Visits every cell that a straight line passes through, in order.
// Refuses lines that are not finite.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "ingest/grid/grid_frame.h"

namespace dsg::ingest {

/// Calls `visit(cell, enter, leave)` with the fractions of the line at which it enters and leaves
/// the cell, until it returns false. Cells outside the grid are left out. Returns whether all
/// visits returned true; false for a line that is not finite.
///
/// Source: Amanatides and Woo, 1987.
template <typename Visit>
bool WalkLine(const GridFrame& frame, const Eigen::Vector3d& from_map,
              const Eigen::Vector3d& to_map, const Visit& visit) {
  const Eigen::Vector3d from = (from_map - frame.origin_map) / frame.cell_m;
  const Eigen::Vector3d way = (to_map - from_map) / frame.cell_m;
  if (!from.allFinite() || !way.allFinite()) return false;
  double begin = 0.0;
  double end = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double high = frame.size[axis];
    if (way[axis] == 0.0) {
      if (from[axis] < 0.0 || from[axis] >= high) return true;
      continue;
    }
    const double a = -from[axis] / way[axis];
    const double b = (high - from[axis]) / way[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (begin > end || frame.CellCount() == 0) return true;
  const Eigen::Vector3d entry = from + begin * way;
  Eigen::Vector3i cell;
  Eigen::Vector3d next;
  Eigen::Vector3d step;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(std::floor(entry[axis])), 0, frame.size[axis] - 1);
    const bool is_up = way[axis] > 0.0;
    step[axis] = way[axis] == 0.0 ? 0.0 : 1.0 / std::abs(way[axis]);
    next[axis] = way[axis] == 0.0 ? std::numeric_limits<double>::infinity()
                                  : (cell[axis] + (is_up ? 1 : 0) - from[axis]) / way[axis];
  }
  double enter = begin;
  while (true) {
    int axis = 0;
    const double leave = next.minCoeff(&axis);
    if (!visit(cell, enter, std::min(leave, end))) return false;
    if (leave >= end) return true;
    cell[axis] += way[axis] > 0.0 ? 1 : -1;
    if (cell[axis] < 0 || cell[axis] >= frame.size[axis]) return true;
    next[axis] += step[axis];
    enter = leave;
  }
}

}  // namespace dsg::ingest
