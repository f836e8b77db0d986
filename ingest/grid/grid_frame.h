// SPDX-License-Identifier: Apache-2.0
// Where the cells of a dense grid lie in the map.
// Refuses to hold cells.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace dsg::ingest {

/// Cell (x, y, z) covers origin + [x, x + 1) * cell_m and so on; x runs fastest in memory.
struct GridFrame {
  static constexpr double kCellMax = 1e9;
  /// Low corner of cell (0, 0, 0); a multiple of cell_m, so that grids of one map match.
  Eigen::Vector3d origin_map = Eigen::Vector3d::Zero();
  double cell_m = 0.1;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  int64_t CellCount() const { return int64_t{size.x()} * size.y() * size.z(); }
  bool Holds(const Eigen::Vector3i& cell) const {
    return (cell.array() >= 0).all() && (cell.array() < size.array()).all();
  }
  /// Requires: Holds(cell).
  int64_t Index(const Eigen::Vector3i& cell) const {
    return (int64_t{cell.z()} * size.y() + cell.y()) * size.x() + cell.x();
  }
  Eigen::Vector3i Cell(int64_t index) const {
    const int64_t row = index / size.x();
    return {static_cast<int>(index % size.x()), static_cast<int>(row % size.y()),
            static_cast<int>(row / size.y())};
  }
  /// The cell that holds a point, inside the grid or not; of points that are not finite or very
  /// far away, one outside.
  Eigen::Vector3i CellOf(const Eigen::Vector3d& point_map) const {
    const Eigen::Vector3d at = ((point_map - origin_map) / cell_m).array().floor();
    if (!(at.array().abs() < kCellMax).all()) return Eigen::Vector3i::Constant(-1);
    return at.cast<int>();
  }
  Eigen::Vector3d Center(const Eigen::Vector3i& cell) const {
    return origin_map + cell_m * (cell.cast<double>() + Eigen::Vector3d::Constant(0.5));
  }
};

}  // namespace dsg::ingest
