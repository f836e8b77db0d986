// SPDX-License-Identifier: Apache-2.0
// Where the middle of a robot may be, cell by cell, on a floor or in a volume.
// Refuses to plan: it answers for cells and straight lines.
#pragma once

#include <vector>

#include "ingest/grid/distance_field.h"

namespace dsg::ingest {

/// Threads: safe from many threads.
class OpenSpace {
 public:
  /// Smallest difference of two clearances that means anything.
  static constexpr double kRoundingM = 1e-6;

  /// `grid`: one cell high for ground robots.
  OpenSpace(OccupancyGrid grid, double robot_radius_m);

  const DistanceField& field() const { return field_; }
  const GridFrame& frame() const { return field_.frame(); }
  double robot_radius_m() const { return robot_radius_m_; }
  bool IsFlat() const { return frame().size.z() == 1; }

  Eigen::Vector3d CenterOf(int64_t cell) const { return frame().Center(frame().Cell(cell)); }
  double ClearanceM(int64_t cell) const { return field_.CellClearanceM(cell); }
  /// A robot fits here.
  bool IsOpen(int64_t cell) const { return Fits(cell, robot_radius_m_); }
  bool Fits(int64_t cell, double radius_m) const {
    return field_.grid().cells[cell] == Occupancy::kFree &&
           ClearanceM(cell) + kRoundingM >= radius_m;
  }
  /// A robot fits on all of the straight line between the middles of two cells.
  bool IsOpenWay(int64_t from, int64_t to) const { return IsWayFor(from, to, robot_radius_m_); }
  bool IsWayFor(int64_t from, int64_t to, double radius_m) const;
  /// Offsets to the neighbours of a cell, 8 or 26.
  const std::vector<Eigen::Vector3i>& neighbours() const { return neighbours_; }

 private:
  DistanceField field_;
  double robot_radius_m_;
  std::vector<Eigen::Vector3i> neighbours_;
};

}  // namespace dsg::ingest
