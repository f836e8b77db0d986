// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/clearance_rooms.h"

#include <algorithm>
#include <vector>

namespace dsg::ingest {

DividedPlan ClearanceRegions(const OccupancyGrid& plan, const RoomOptions& options) {
  DividedPlan divided = DivideAtGaps(plan, options, OpenRooms::kClose);
  // Given to a neighbour, not opened to all: two rooms would meet through a corner between them.
  const double cell_m2 = plan.frame.cell_m * plan.frame.cell_m;
  std::vector<bool> is_kept;
  for (const int64_t count : divided.regions.CellCounts()) {
    is_kept.push_back(static_cast<double>(count) * cell_m2 >= options.clearance_room_m2_min);
  }
  if (std::find(is_kept.begin(), is_kept.end(), true) != is_kept.end()) {
    KeepRegions(is_kept, &divided.regions);
  }
  std::vector<uint8_t> may_grow(plan.cells.size());
  for (size_t i = 0; i < may_grow.size(); ++i) {
    may_grow[i] = plan.cells[i] == Occupancy::kFree ? 1 : 0;
  }
  GrowRegions(may_grow, 1e6, &divided.regions);
  return divided;
}

}  // namespace dsg::ingest
