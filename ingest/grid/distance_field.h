// SPDX-License-Identifier: Apache-2.0
// How far the nearest obstacle is from every cell of a grid, and which one it is.
// Refuses to guess: what has not been seen is neither free nor an obstacle.
#pragma once

#include <vector>

#include "ingest/grid/occupancy_grid.h"

namespace dsg::ingest {

/// Euclidean distances between cell centres, exact.
///
/// Threads: safe from many threads once computed.
/// Source: Felzenszwalb and Huttenlocher, 2012 (separable exact transform).
class DistanceField {
 public:
  /// Larger distances are cut to this.
  static constexpr float kFarM = 1000.0f;

  DistanceField() = default;
  /// A grid of 2^31 cells or more, or one that is longer than 26 000 cells, is taken for an empty
  /// one; missing cells are unknown.
  ///
  /// Cost: linear in the cells; 13.5 M cells in about a second on two threads.
  explicit DistanceField(OccupancyGrid grid);

  const GridFrame& frame() const { return grid_.frame; }
  const OccupancyGrid& grid() const { return grid_; }

  /// Metres to the centre of the nearest occupied cell; 0 in one, kFarM where there is none.
  /// Requires: inside.
  float DistanceM(int64_t index) const { return distance_m_[index]; }
  /// Index of the nearest occupied cell; -1 = none. The lower index of equally near ones.
  int64_t NearestObstacle(int64_t index) const { return nearest_[index]; }

  /// Distance of a cell less half a cell, at least 0; 0 in cells that are not free.
  /// Requires: inside.
  double CellClearanceM(int64_t index) const;
  /// Clearance of a point's cell; 0 outside.
  double ClearanceM(const Eigen::Vector3d& point_map) const;
  /// Least clearance of all cells that a straight line passes; 0 as soon as it leaves free space.
  double SegmentClearanceM(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map) const;
  /// SegmentClearanceM is at least `clearance_m` and above 0, but sooner.
  bool HasClearance(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                    double clearance_m) const;
  /// No occupied cell is on the straight line; cells that were never seen do not block. Ends in
  /// occupied cells are forgiven over `forgiven_m` at either end.
  bool HasLineOfSight(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                      double forgiven_m) const;

 private:
  OccupancyGrid grid_;
  std::vector<float> distance_m_;
  std::vector<int32_t> nearest_;
};

}  // namespace dsg::ingest
