// SPDX-License-Identifier: Apache-2.0
// The nearest of many points, by a uniform grid over x and y.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace dsg::ingest {

/// Points of the map frame with the caller's numbers for them.
class PlaceGrid {
 public:
  struct Item {
    int32_t number = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
  };
  struct Found {
    int32_t number = -1;
    double distance_m = 0.0;
  };

  PlaceGrid() = default;
  explicit PlaceGrid(std::vector<Item> items);

  bool empty() const { return items_.empty(); }

  /// Whether an item, by its number, may be taken. Empty = all may.
  using Accept = std::function<bool(int32_t number)>;

  /// The item with the least distance in space; the lower number when two are as near. -1 when
  /// none nearer than `distance_m_max` is accepted.
  /// Cost: the cells around the point, wherever the point is. Requires: not empty.
  Found Nearest(const Eigen::Vector3d& point, const Accept& accept = {},
                double distance_m_max = std::numeric_limits<double>::infinity()) const;

 private:
  int64_t CellOf(double value, double origin, int64_t count) const;
  struct Search {
    const Eigen::Vector3d& point;
    const Accept& accept;
    Found best;
  };
  void SearchCell(int64_t x, int64_t y, Search* search) const;
  void SearchRing(int64_t x, int64_t y, int64_t ring, Search* search) const;

  /// Grouped by cell, row by row; the cell i holds items [cell_begin_[i], cell_begin_[i + 1]).
  std::vector<Item> items_;
  std::vector<uint32_t> cell_begin_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double cell_size_m_ = 1.0;
  int64_t count_x_ = 0;
  int64_t count_y_ = 0;
};

}  // namespace dsg::ingest
