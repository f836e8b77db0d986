// SPDX-License-Identifier: Apache-2.0
// The true free space seen from above: distances to obstacles, straight ways, shortest ways.
// Refuses heights; the grid knows one band of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "ingest/truth/truth.h"

namespace dsg::evaluation {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Exact Euclidean distances on a grid: from each cell's middle to the middle of the nearest cell
/// that is set, in cells. Infinite when none is set.
/// Cost:   linear. Source: Felzenszwalb and Huttenlocher 2012.
std::vector<double> DistanceTransform(const std::vector<uint8_t>& is_set, int width, int height);

/// Threads: safe from many threads.
class GridMap {
 public:
  /// `grid` must outlive this. Outside the grid everything is an obstacle.
  explicit GridMap(const truth::FreeGrid* grid);

  const truth::FreeGrid& grid() const { return *grid_; }
  size_t cell_count() const { return clearance_m_.size(); }
  /// nullopt outside.
  std::optional<size_t> CellAt(const Eigen::Vector2d& point_map) const;
  Eigen::Vector2d CenterOf(size_t cell) const;
  bool Has(size_t cell, uint8_t bits) const { return (grid_->cells[cell] & bits) == bits; }
  /// From the cell's middle to the middle of the nearest cell that is not free; 0 there.
  double ClearanceOf(size_t cell) const { return clearance_m_[cell]; }
  /// Every place on the straight way has at least this clearance.
  bool IsStraightWay(const Eigen::Vector2d& from_map, const Eigen::Vector2d& to_map,
                     double clearance_m) const;
  /// Lengths of the shortest 8-connected ways from a cell over cells of at least this clearance,
  /// metres; infinite where there is none.
  std::vector<double> WaysFrom(size_t start, double clearance_m) const;

 private:
  const truth::FreeGrid* grid_;
  std::vector<double> clearance_m_;
};

}  // namespace dsg::evaluation
