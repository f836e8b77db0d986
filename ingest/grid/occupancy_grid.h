// SPDX-License-Identifier: Apache-2.0
// What has been seen of each cell of a part of the map: nothing, empty space, or something.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/grid/grid_frame.h"

namespace dsg::ingest {

/// Ordered so that the larger one wins when cells are joined.
enum class Occupancy : uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

struct OccupancyGrid {
  GridFrame frame;
  /// frame.CellCount() of them.
  std::vector<Occupancy> cells;

  /// kUnknown outside.
  Occupancy At(const Eigen::Vector3i& cell) const {
    return frame.Holds(cell) ? cells[frame.Index(cell)] : Occupancy::kUnknown;
  }
  Occupancy AtPoint(const Eigen::Vector3d& point_map) const { return At(frame.CellOf(point_map)); }
};

}  // namespace dsg::ingest
