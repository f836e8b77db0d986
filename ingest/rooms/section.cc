// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/section.h"

#include <algorithm>
#include <cmath>

#include "ingest/grid/distance_field.h"

namespace dsg::ingest {
namespace {

int LayerAt(const GridFrame& frame, double z_m) {
  return static_cast<int>(std::floor((z_m - frame.origin_map.z()) / frame.cell_m));
}

int64_t ColumnCount(const GridFrame& frame) { return int64_t{frame.size.x()} * frame.size.y(); }

// Joins the layers whose middles are between two heights.
void JoinLayers(const OccupancyGrid& grid, double low_m, double high_m, OccupancyGrid* plan) {
  const int64_t columns = ColumnCount(grid.frame);
  const int first = std::max(0, LayerAt(grid.frame, low_m));
  const int last = std::min(grid.frame.size.z() - 1, LayerAt(grid.frame, high_m));
  for (int layer = first; layer <= last; ++layer) {
    const Occupancy* cells = grid.cells.data() + layer * columns;
    for (int64_t i = 0; i < columns; ++i) plan->cells[i] = std::max(plan->cells[i], cells[i]);
  }
}

// Cells within `radius_m` of a marked one.
DistanceField DistancesTo(const GridFrame& frame, const std::vector<uint8_t>& is_marked) {
  OccupancyGrid marked{frame, std::vector<Occupancy>(is_marked.size(), Occupancy::kFree)};
  for (size_t i = 0; i < is_marked.size(); ++i) {
    if (is_marked[i] != 0) marked.cells[i] = Occupancy::kOccupied;
  }
  return DistanceField(std::move(marked));
}

}  // namespace

OccupancyGrid EmptyPlan(const GridFrame& frame) {
  OccupancyGrid plan{frame, {}};
  plan.frame.size.z() = 1;
  plan.cells.assign(static_cast<size_t>(plan.frame.CellCount()), Occupancy::kUnknown);
  return plan;
}

OccupancyGrid CeilingSection(const OccupancyGrid& grid, double floor_z_m,
                             const CeilingMap& ceilings, const SectionOptions& options) {
  OccupancyGrid plan = EmptyPlan(grid.frame);
  const int64_t columns = ColumnCount(grid.frame);
  const double low_m = floor_z_m + options.above_doors_m;
  for (int64_t i = 0; i < columns; ++i) {
    const double ceiling_m = static_cast<double>(ceilings.z_m[i]);
    if (std::isnan(ceiling_m)) continue;
    for (int times = 1; times <= options.step_count_max && plan.cells[i] == Occupancy::kUnknown;
         ++times) {
      double z_m = ceiling_m - times * options.below_ceiling_m;
      if (z_m < low_m && times > 1) break;
      // Under a low ceiling, between its underside and the lintels.
      z_m = std::max(z_m, std::min(low_m, ceiling_m - 1.5 * grid.frame.cell_m));
      const int layer = LayerAt(grid.frame, z_m);
      if (layer >= 0 && layer < grid.frame.size.z())
        plan.cells[i] = grid.cells[layer * columns + i];
    }
  }
  return plan;
}

OccupancyGrid BodySection(const OccupancyGrid& grid, double floor_z_m,
                          const SectionOptions& options) {
  OccupancyGrid plan = EmptyPlan(grid.frame);
  if (grid.frame.size.z() == 1) {
    plan.cells = grid.cells;
    return plan;
  }
  JoinLayers(grid, floor_z_m + options.head_min_m, floor_z_m + options.head_max_m, &plan);
  OccupancyGrid low = EmptyPlan(grid.frame);
  JoinLayers(grid, floor_z_m + options.low_min_m, floor_z_m + options.low_max_m, &low);
  FillFrom(low, &plan);
  return plan;
}

void FillHoles(double width_m, OccupancyGrid* plan) {
  const size_t count = plan->cells.size();
  const double radius_m = 0.5 * width_m;
  std::vector<uint8_t> marks(count);
  for (size_t i = 0; i < count; ++i) marks[i] = plan->cells[i] == Occupancy::kFree ? 1 : 0;
  const DistanceField to_free = DistancesTo(plan->frame, marks);
  for (size_t i = 0; i < count; ++i) {
    marks[i] = static_cast<double>(to_free.DistanceM(static_cast<int64_t>(i))) > radius_m ? 1 : 0;
  }
  const DistanceField to_far = DistancesTo(plan->frame, marks);
  for (size_t i = 0; i < count; ++i) {
    const bool closes = static_cast<double>(to_far.DistanceM(static_cast<int64_t>(i))) > radius_m;
    if (plan->cells[i] == Occupancy::kUnknown && closes) plan->cells[i] = Occupancy::kFree;
  }
}

void FillFrom(const OccupancyGrid& other, OccupancyGrid* plan) {
  for (size_t i = 0; i < plan->cells.size(); ++i) {
    if (plan->cells[i] == Occupancy::kUnknown) plan->cells[i] = other.cells[i];
  }
}

void FillOccupiedFrom(const OccupancyGrid& other, OccupancyGrid* plan) {
  for (size_t i = 0; i < plan->cells.size(); ++i) {
    const bool is_blocked = other.cells[i] == Occupancy::kOccupied;
    if (plan->cells[i] == Occupancy::kUnknown && is_blocked) plan->cells[i] = other.cells[i];
  }
}

}  // namespace dsg::ingest
