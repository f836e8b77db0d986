// SPDX-License-Identifier: Apache-2.0
// Points in the cells of a horizontal grid, for lookups by distance. Immutable.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace dsg::merge {

class PointGrid {
 public:
  /// Requires: cell_m above zero.
  PointGrid(const std::vector<Eigen::Vector3d>& points, double cell_m) : cell_m_(cell_m) {
    entries_.reserve(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      entries_.push_back({KeyOf(points[i].x(), points[i].y()), static_cast<int>(i)});
    }
    std::sort(entries_.begin(), entries_.end());
  }

  /// Calls `visit(index)` for all points within `reach_m` of a point on both axes, and for some
  /// beyond.
  template <typename Visit>
  void ForEachNear(const Eigen::Vector3d& point, double reach_m, Visit visit) const {
    const int64_t y_min = CellOf(point.y() - reach_m);
    const int64_t y_max = CellOf(point.y() + reach_m);
    const int64_t x_min = CellOf(point.x() - reach_m);
    const int64_t x_max = CellOf(point.x() + reach_m);
    for (int64_t y = y_min; y <= y_max; ++y) {
      const Key from{y, x_min};
      for (auto it = std::lower_bound(entries_.begin(), entries_.end(), Entry{from, -1});
           it != entries_.end() && it->first.first == y && it->first.second <= x_max; ++it) {
        visit(it->second);
      }
    }
  }

 private:
  /// Row, column.
  using Key = std::pair<int64_t, int64_t>;
  using Entry = std::pair<Key, int>;

  int64_t CellOf(double metres) const { return static_cast<int64_t>(std::floor(metres / cell_m_)); }
  Key KeyOf(double x, double y) const { return {CellOf(y), CellOf(x)}; }

  double cell_m_;
  std::vector<Entry> entries_;
};

}  // namespace dsg::merge
