// SPDX-License-Identifier: Apache-2.0
#include "ingest/grid/distance_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/grid/distance_transform.h"
#include "ingest/grid/line_walk.h"

namespace dsg::ingest {
namespace {

// The second core of a small machine; more gain little, the memory is the limit.
constexpr int kThreadCount = 2;

}  // namespace

DistanceField::DistanceField(OccupancyGrid grid) : grid_(std::move(grid)) {
  if (!CanMeasure(grid_.frame)) grid_ = OccupancyGrid();
  grid_.cells.resize(grid_.frame.CellCount(), Occupancy::kUnknown);
  ObstacleDistances obstacles = MeasureObstacles(grid_, kThreadCount);
  nearest_ = std::move(obstacles.nearest);
  distance_m_.reserve(nearest_.size());
  for (const int32_t squared : obstacles.squared_cells) {
    const double distance_m = grid_.frame.cell_m * std::sqrt(static_cast<double>(squared));
    const bool is_far = squared == ObstacleDistances::kFarSquared || distance_m > kFarM;
    distance_m_.push_back(is_far ? kFarM : static_cast<float>(distance_m));
  }
}

double DistanceField::CellClearanceM(int64_t index) const {
  if (grid_.cells[index] != Occupancy::kFree) return 0.0;
  return std::max(0.0, static_cast<double>(distance_m_[index]) - 0.5 * grid_.frame.cell_m);
}

double DistanceField::ClearanceM(const Eigen::Vector3d& point_map) const {
  const Eigen::Vector3i cell = grid_.frame.CellOf(point_map);
  return grid_.frame.Holds(cell) ? CellClearanceM(grid_.frame.Index(cell)) : 0.0;
}

double DistanceField::SegmentClearanceM(const Eigen::Vector3d& from_map,
                                        const Eigen::Vector3d& to_map) const {
  double least = std::min(ClearanceM(from_map), ClearanceM(to_map));
  if (least == 0.0) return 0.0;
  WalkLine(grid_.frame, from_map, to_map, [&](const Eigen::Vector3i& cell, double, double) {
    least = std::min(least, CellClearanceM(grid_.frame.Index(cell)));
    return least > 0.0;
  });
  return least;
}

bool DistanceField::HasClearance(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                                 double clearance_m) const {
  if (ClearanceM(from_map) < clearance_m || ClearanceM(to_map) < clearance_m) return false;
  return WalkLine(grid_.frame, from_map, to_map, [&](const Eigen::Vector3i& cell, double, double) {
    const double here_m = CellClearanceM(grid_.frame.Index(cell));
    return here_m > 0.0 && here_m >= clearance_m;
  });
}

bool DistanceField::HasLineOfSight(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                                   double forgiven_m) const {
  const double length_m = (to_map - from_map).norm();
  return WalkLine(grid_.frame, from_map, to_map,
                  [&](const Eigen::Vector3i& cell, double enter, double leave) {
                    if (grid_.cells[grid_.frame.Index(cell)] != Occupancy::kOccupied) return true;
                    return leave * length_m <= forgiven_m || (1.0 - enter) * length_m <= forgiven_m;
                  });
}

}  // namespace dsg::ingest
