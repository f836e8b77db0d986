// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/plan_regions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/rooms/open_rooms.h"

namespace dsg::ingest {
namespace {

// Calls `visit` with the 4-neighbours of a cell.
template <typename Visit>
void VisitNeighbours(const GridFrame& frame, int64_t cell, const Visit& visit) {
  const int64_t width = frame.size.x();
  const int64_t column = cell % width;
  if (column > 0) visit(cell - 1);
  if (column + 1 < width) visit(cell + 1);
  if (cell >= width) visit(cell - width);
  if (cell + width < frame.CellCount()) visit(cell + width);
}

PlanRegions LabelClear(OccupancyGrid plan, const RoomOptions& options) {
  const GridFrame frame = plan.frame;
  const DistanceField field(std::move(plan));
  std::vector<uint8_t> is_member(static_cast<size_t>(frame.CellCount()), 0);
  for (int64_t i = 0; i < frame.CellCount(); ++i) {
    const bool is_free = field.grid().cells[static_cast<size_t>(i)] == Occupancy::kFree;
    const bool is_clear = static_cast<double>(field.DistanceM(i)) > options.section_clearance_m;
    is_member[static_cast<size_t>(i)] = is_free && is_clear ? 1 : 0;
  }
  return LabelRegions(frame, is_member, options.room_m2_min);
}

// The region before (side 1) or behind (side -1) a gap.
int RegionBeside(const PlanRegions& regions, const WallGap& gap, double side, double reach_m) {
  for (double depth_m = 0.0; depth_m <= reach_m; depth_m += 0.5 * regions.frame.cell_m) {
    const int region = regions.At(gap.MiddleMap() + side * depth_m * gap.NormalMap());
    if (region >= 0) return region;
  }
  return -1;
}

bool PartsRegions(const PlanRegions& regions, const WallGap& gap, double reach_m) {
  const int before = RegionBeside(regions, gap, 1.0, reach_m);
  const int behind = RegionBeside(regions, gap, -1.0, reach_m);
  return before >= 0 && behind >= 0 && before != behind;
}

}  // namespace

int PlanRegions::At(const Eigen::Vector2d& point_map) const {
  Eigen::Vector3i cell = frame.CellOf({point_map.x(), point_map.y(), frame.origin_map.z()});
  cell.z() = 0;
  return frame.Holds(cell) ? region_of[static_cast<size_t>(frame.Index(cell))] : -1;
}

std::vector<int64_t> PlanRegions::CellCounts() const {
  std::vector<int64_t> counts(static_cast<size_t>(count), 0);
  for (const int region : region_of) {
    if (region >= 0) ++counts[static_cast<size_t>(region)];
  }
  return counts;
}

PlanRegions LabelRegions(const GridFrame& frame, const std::vector<uint8_t>& is_member,
                         double m2_min) {
  PlanRegions regions{frame, std::vector<int>(is_member.size(), -1), 0};
  const double cell_m2 = frame.cell_m * frame.cell_m;
  std::vector<int64_t> open;
  std::vector<bool> is_kept;
  for (size_t start = 0; start < is_member.size(); ++start) {
    if (is_member[start] == 0 || regions.region_of[start] >= 0) continue;
    const int region = regions.count++;
    open.assign(1, static_cast<int64_t>(start));
    regions.region_of[start] = region;
    for (size_t next = 0; next < open.size(); ++next) {
      VisitNeighbours(frame, open[next], [&](int64_t cell) {
        const auto i = static_cast<size_t>(cell);
        if (is_member[i] == 0 || regions.region_of[i] >= 0) return;
        regions.region_of[i] = region;
        open.push_back(cell);
      });
    }
    is_kept.push_back(static_cast<double>(open.size()) * cell_m2 >= m2_min);
  }
  KeepRegions(is_kept, &regions);
  return regions;
}

DividedPlan DivideAtGaps(const OccupancyGrid& plan, const RoomOptions& options,
                         OpenRooms open_rooms) {
  const std::vector<WallGap> gaps = FindWallGaps(DistanceField(plan), options.gaps);
  DividedPlan divided{{}, plan};
  for (const WallGap& gap : gaps) CloseGap(gap, &divided.closed);
  divided.regions = LabelClear(divided.closed, options);
  // A gap whose sides meet elsewhere, or that only cuts off a corner, is none between rooms.
  OccupancyGrid closed = plan;
  size_t kept_count = 0;
  for (const WallGap& gap : gaps) {
    if (!PartsRegions(divided.regions, gap, options.gaps.region_reach_m)) continue;
    CloseGap(gap, &closed);
    ++kept_count;
  }
  if (open_rooms == OpenRooms::kClose) {
    CloseOpenRooms(options.open, &closed);
  } else if (kept_count == gaps.size()) {
    return divided;
  }
  divided.closed = std::move(closed);
  divided.regions = LabelClear(divided.closed, options);
  return divided;
}

void GrowRegions(const std::vector<uint8_t>& may_grow, double distance_m, PlanRegions* regions) {
  const int rounds = static_cast<int>(std::lround(distance_m / regions->frame.cell_m));
  std::vector<int64_t> front;
  for (size_t i = 0; i < regions->region_of.size(); ++i) {
    if (regions->region_of[i] >= 0) front.push_back(static_cast<int64_t>(i));
  }
  std::vector<int64_t> next;
  for (int round = 0; round < rounds && !front.empty(); ++round) {
    next.clear();
    for (const int64_t from : front) {
      const int region = regions->region_of[static_cast<size_t>(from)];
      VisitNeighbours(regions->frame, from, [&](int64_t cell) {
        int& other = regions->region_of[static_cast<size_t>(cell)];
        if (other >= 0 || may_grow[static_cast<size_t>(cell)] == 0) return;
        other = region;
        next.push_back(cell);
      });
    }
    front.swap(next);
  }
}

void KeepRegions(const std::vector<bool>& is_kept, PlanRegions* regions) {
  std::vector<int> renamed(static_cast<size_t>(regions->count), -1);
  int count = 0;
  for (size_t region = 0; region < renamed.size(); ++region) {
    if (is_kept[region]) renamed[region] = count++;
  }
  for (int& region : regions->region_of) {
    if (region >= 0) region = renamed[static_cast<size_t>(region)];
  }
  regions->count = count;
}

}  // namespace dsg::ingest
