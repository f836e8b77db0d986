// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include "ingest/places/extract_places.h"
#include "ingest/places/space_grid.h"

namespace dsg::ingest {
namespace {

// For each layer, the number of columns in which one could stand on it.
std::vector<int64_t> CountStandingRoom(const OccupancyGrid& grid, const PlaceOptions& options) {
  const Eigen::Vector3i& size = grid.frame.size;
  const int64_t layer = int64_t{size.x()} * size.y();
  const int headroom =
      std::max(1, static_cast<int>(std::ceil(options.headroom_m / grid.frame.cell_m)));
  const double seen_min = options.headroom_seen_share * headroom;
  std::vector<int64_t> counts(size.z(), 0);
  // Of each column, layers and free layers above the last occupied one; -1 = none so far.
  std::vector<int> last(layer, -1);
  std::vector<int> free_count(layer, 0);
  for (int z = 0; z < size.z(); ++z) {
    for (int64_t i = 0; i < layer; ++i) {
      const Occupancy cell = grid.cells[z * layer + i];
      if (cell == Occupancy::kOccupied) {
        last[i] = z;
        free_count[i] = 0;
        continue;
      }
      if (last[i] < 0) continue;
      free_count[i] += cell == Occupancy::kFree ? 1 : 0;
      if (z - last[i] == headroom && free_count[i] >= seen_min) ++counts[last[i]];
    }
  }
  return counts;
}

struct Level {
  int layer = 0;
  int64_t count = 0;
};

int64_t CountAround(const std::vector<int64_t>& counts, int layer) {
  const int begin = std::max(0, layer - 1);
  const int end = std::min(static_cast<int>(counts.size()), layer + 2);
  return std::accumulate(counts.begin() + begin, counts.begin() + end, int64_t{0});
}

// Largest first; others within a storey's height of a taken one are tables and stairs.
std::vector<Level> PickLevels(const std::vector<int64_t>& counts, const GridFrame& frame,
                              const PlaceOptions& options) {
  std::vector<Level> levels;
  for (int z = 0; z < static_cast<int>(counts.size()); ++z) {
    levels.push_back({z, CountAround(counts, z)});
  }
  std::stable_sort(levels.begin(), levels.end(),
                   [](const Level& a, const Level& b) { return a.count > b.count; });
  std::vector<Level> picked;
  for (const Level& level : levels) {
    const double area_m2 = frame.cell_m * frame.cell_m * static_cast<double>(level.count);
    if (area_m2 < options.floor_m2_min) break;
    const auto largest = static_cast<double>(levels.front().count);
    if (static_cast<double>(level.count) < options.floor_share_min * largest) break;
    const bool is_far = std::all_of(picked.begin(), picked.end(), [&](const Level& other) {
      return frame.cell_m * std::abs(level.layer - other.layer) >= options.storey_m_min - 1e-6;
    });
    if (is_far) picked.push_back(level);
  }
  return picked;
}

// Noise lifts a part of a floor into the next layer; that layer is floor all the same.
int TopLayer(const std::vector<int64_t>& counts, const Level& level, double share_min) {
  for (int z = std::min(static_cast<int>(counts.size()) - 1, level.layer + 1); z > level.layer;
       --z) {
    const auto count = static_cast<double>(counts[z]);
    if (count >= share_min * static_cast<double>(level.count)) return z;
  }
  return level.layer;
}

bool IsVisited(double floor_z_m, const std::vector<Eigen::Vector3d>& path,
               const PlaceOptions& options) {
  return std::any_of(path.begin(), path.end(), [&](const Eigen::Vector3d& point) {
    return point.z() > floor_z_m - options.below_floor_m &&
           point.z() < floor_z_m + options.storey_m_min;
  });
}

}  // namespace

std::vector<double> FindFloors(const OccupancyGrid& grid, const std::vector<Eigen::Vector3d>& path,
                               const PlaceOptions& options) {
  if (!IsSound(grid)) return {};
  const std::vector<int64_t> counts = CountStandingRoom(grid, options);
  std::vector<double> floors_m;
  std::vector<double> visited_m;
  for (const Level& level : PickLevels(counts, grid.frame, options)) {
    const int layer = TopLayer(counts, level, options.floor_layer_share);
    const double floor_z_m = grid.frame.origin_map.z() + grid.frame.cell_m * layer;
    floors_m.push_back(floor_z_m);
    if (IsVisited(floor_z_m, path, options)) visited_m.push_back(floor_z_m);
  }
  // A roof or a gallery that the robot only saw from afar is no floor of its map.
  if (!visited_m.empty()) floors_m = visited_m;
  std::sort(floors_m.begin(), floors_m.end());
  return floors_m;
}

}  // namespace dsg::ingest
