// SPDX-License-Identifier: Apache-2.0
// Which height the ceiling has over each column: what many columns around it agree on.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ingest/rooms/section.h"

namespace dsg::ingest {
namespace {

/// Index of the layer in which each column first meets something above it from below; -1 = none.
std::vector<int> FirstUndersides(const OccupancyGrid& grid, double floor_z_m,
                                 double ceiling_min_m) {
  const GridFrame& frame = grid.frame;
  const int64_t columns = int64_t{frame.size.x()} * frame.size.y();
  std::vector<int> layers(static_cast<size_t>(columns), -1);
  const double low = (floor_z_m + ceiling_min_m - frame.origin_map.z()) / frame.cell_m;
  for (int z = std::max(1, static_cast<int>(std::floor(low))); z < frame.size.z(); ++z) {
    const Occupancy* here = grid.cells.data() + z * columns;
    const Occupancy* below = here - columns;
    for (int64_t i = 0; i < columns; ++i) {
      const bool is_underside = here[i] == Occupancy::kOccupied && below[i] == Occupancy::kFree;
      if (is_underside && layers[i] < 0) layers[i] = z;
    }
  }
  return layers;
}

std::vector<int> FindModes(const std::vector<int>& layers, const GridFrame& frame, double m2_min) {
  std::vector<int64_t> counts(static_cast<size_t>(frame.size.z()) + 2, 0);
  for (const int layer : layers) {
    if (layer >= 0) ++counts[static_cast<size_t>(layer) + 1];
  }
  const double cell_m2 = frame.cell_m * frame.cell_m;
  std::vector<int> modes;
  for (int z = 0; z < frame.size.z(); ++z) {
    const auto at = static_cast<size_t>(z) + 1;
    const bool is_peak = counts[at] > counts[at - 1] && counts[at] >= counts[at + 1];
    const int64_t count = counts[at - 1] + counts[at] + counts[at + 1];
    if (is_peak && static_cast<double>(count) * cell_m2 >= m2_min) modes.push_back(z);
  }
  return modes;
}

// Number of columns of each window whose layer is at most one from `mode`, by running sums.
std::vector<int> CountAround(const std::vector<int>& layers, const GridFrame& frame, int mode,
                             int reach) {
  const int width = frame.size.x();
  const int height = frame.size.y();
  const auto row_length = static_cast<size_t>(width) + 1;
  std::vector<int> sums(row_length * (static_cast<size_t>(height) + 1), 0);
  const auto sum_at = [&](int x, int y) -> int& {
    return sums[static_cast<size_t>(y) * row_length + static_cast<size_t>(x)];
  };
  for (int y = 0; y < height; ++y) {
    int row = 0;
    for (int x = 0; x < width; ++x) {
      const int layer =
          layers[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      row += layer >= 0 && std::abs(layer - mode) <= 1 ? 1 : 0;
      sum_at(x + 1, y + 1) = sum_at(x + 1, y) + row;
    }
  }
  std::vector<int> counts(layers.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int x0 = std::max(0, x - reach);
      const int y0 = std::max(0, y - reach);
      const int x1 = std::min(width, x + reach + 1);
      const int y1 = std::min(height, y + reach + 1);
      counts[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
          sum_at(x1, y1) - sum_at(x0, y1) - sum_at(x1, y0) + sum_at(x0, y0);
    }
  }
  return counts;
}

// Where some ceiling takes more than a share of the window, the one that takes most.
void Vote(const std::vector<int>& layers, const std::vector<int>& modes, const GridFrame& frame,
          double window_m, double share, std::vector<float>* z_m) {
  const int reach = std::max(1, static_cast<int>(std::lround(0.5 * window_m / frame.cell_m)));
  const auto least = static_cast<int>(share * (2 * reach + 1) * (2 * reach + 1));
  std::vector<int> best(z_m->size(), least);
  std::vector<int> mode_of(z_m->size(), -1);
  for (const int mode : modes) {
    const std::vector<int> counts = CountAround(layers, frame, mode, reach);
    for (size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] <= best[i]) continue;
      best[i] = counts[i];
      mode_of[i] = mode;
    }
  }
  for (size_t i = 0; i < z_m->size(); ++i) {
    if (mode_of[i] < 0 || !std::isnan((*z_m)[i])) continue;
    (*z_m)[i] = static_cast<float>(frame.origin_map.z() + (mode_of[i] + 0.5) * frame.cell_m);
  }
}

double SeenShare(const OccupancyGrid& grid, double floor_z_m, const std::vector<int>& layers,
                 const SectionOptions& options) {
  const OccupancyGrid body = BodySection(grid, floor_z_m, options);
  int64_t known = 0;
  int64_t seen = 0;
  for (size_t i = 0; i < layers.size(); ++i) {
    if (body.cells[i] != Occupancy::kFree) continue;
    ++known;
    seen += layers[i] >= 0 ? 1 : 0;
  }
  return known > 0 ? static_cast<double>(seen) / static_cast<double>(known) : 0.0;
}

}  // namespace

CeilingMap FindCeilings(const OccupancyGrid& grid, double floor_z_m,
                        const std::optional<double>& ceiling_z_m, const SectionOptions& options) {
  CeilingMap map;
  const size_t columns =
      static_cast<size_t>(grid.frame.size.x()) * static_cast<size_t>(grid.frame.size.y());
  map.z_m.assign(columns, std::numeric_limits<float>::quiet_NaN());
  if (grid.frame.size.z() < 2) return map;
  const std::vector<int> layers = FirstUndersides(grid, floor_z_m, options.ceiling_min_m);
  const std::vector<int> modes = FindModes(layers, grid.frame, options.ceiling_m2_min);
  map.seen_share = SeenShare(grid, floor_z_m, layers, options);
  // What is near decides; a little farther off where nothing near was seen.
  for (const double window_m : {options.window_m, options.wide_window_m}) {
    Vote(layers, modes, grid.frame, window_m, options.vote_share, &map.z_m);
  }
  if (!ceiling_z_m.has_value()) return map;
  for (float& z_m : map.z_m) {
    if (std::isnan(z_m)) z_m = static_cast<float>(*ceiling_z_m);
  }
  return map;
}

}  // namespace dsg::ingest
