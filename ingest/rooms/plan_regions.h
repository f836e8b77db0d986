// SPDX-License-Identifier: Apache-2.0
// A plan divided into rooms, cell by cell.
// Refuses to know places; place_rooms.h does.
#pragma once

#include <optional>
#include <vector>

#include "ingest/grid/occupancy_grid.h"
#include "ingest/rooms/room_options.h"
#include "ingest/rooms/wall_gaps.h"

namespace dsg::ingest {

struct PlanRegions {
  /// Of one cell's height.
  GridFrame frame;
  /// Region of each cell; -1 = none.
  std::vector<int> region_of;
  int count = 0;

  /// -1 outside. Cost: constant.
  int At(const Eigen::Vector2d& point_map) const;
  std::vector<int64_t> CellCounts() const;
};

/// 4-connected components of the marked cells, by their first cell; smaller ones than `m2_min`
/// are left out.
PlanRegions LabelRegions(const GridFrame& frame, const std::vector<uint8_t>& is_member,
                         double m2_min);

/// Whether bays that stand open to a corridor are rooms too (CloseOpenRooms).
enum class OpenRooms { kLeave, kClose };

struct DividedPlan {
  PlanRegions regions;
  /// The plan with the gaps closed that part one region from another.
  OccupancyGrid closed;
};

/// Components of the free cells far enough from obstacles, with the gaps in walls closed that
/// part one room from another. Cells next to obstacles stay without a region. `plan`: without
/// furniture that stands alone (FreeIslands), between which gaps are no doors.
DividedPlan DivideAtGaps(const OccupancyGrid& plan, const RoomOptions& options,
                         OpenRooms open_rooms);

/// Gives marked cells without a region the nearest region within `distance_m`, by ways over
/// marked cells.
void GrowRegions(const std::vector<uint8_t>& may_grow, double distance_m, PlanRegions* regions);

/// Leaves out the regions that are not kept, and counts the others anew in their order.
void KeepRegions(const std::vector<bool>& is_kept, PlanRegions* regions);

}  // namespace dsg::ingest
