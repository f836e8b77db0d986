// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "ingest/places/extract_places.h"
#include "ingest/places/space_grid.h"

namespace dsg::ingest {
namespace {

// Layers of a grid, the end not included.
struct Band {
  int begin = 0;
  int end = 0;
  int count() const { return end - begin; }
};

// Layers that begin at one height, give or take `cut` of a layer, and whose middle is below the
// other.
Band BandBetween(const GridFrame& frame, double low_z_m, double high_z_m, double cut) {
  if (!std::isfinite(low_z_m) || !std::isfinite(high_z_m)) return {};
  const auto layer = [&](double z_m, double share) {
    const double at = (z_m - frame.origin_map.z()) / frame.cell_m - share;
    const double top = frame.size.z();
    return static_cast<int>(std::ceil(std::clamp(at - 1e-6, 0.0, top)));
  };
  const Band band{layer(low_z_m, cut), layer(high_z_m, 0.5)};
  return band.count() > 0 ? band : Band{};
}

// What the cells of one column add up to.
struct Column {
  int16_t free_count = 0;
  int16_t low_free_count = 0;
  // Unknown cells since the last free one.
  int16_t gap = 0;
  // A free cell, two or more unknown ones, a free cell: a thin board that was seen from both sides.
  bool has_gap = false;
  bool is_occupied = false;

  void Add(Occupancy cell, bool is_low) {
    is_occupied = is_occupied || cell == Occupancy::kOccupied;
    if (cell == Occupancy::kFree) {
      has_gap = has_gap || gap > 1;
      gap = 0;
      ++free_count;
      low_free_count = static_cast<int16_t>(low_free_count + (is_low ? 1 : 0));
    } else if (free_count > 0) {
      ++gap;
    }
  }
};

// A share of the body's height must have been seen, and of its lower half: over the back of a sofa
// one sees the upper half of what stands behind it.
Occupancy Judge(const Column& column, int height, int low_height, double share) {
  if (column.is_occupied) return Occupancy::kOccupied;
  const bool is_free =
      column.free_count >= share * height && column.low_free_count >= share * low_height;
  return is_free ? Occupancy::kFree : Occupancy::kUnknown;
}

// Where one sees down past the floor there is none: a stairwell. `flat` is as wide as `grid`.
void BlockHoles(const OccupancyGrid& grid, double floor_z_m, const PlaceOptions& options,
                OccupancyGrid* flat) {
  const GridFrame& frame = grid.frame;
  const double top_z_m = floor_z_m + frame.cell_m;
  const Band band =
      BandBetween(frame, floor_z_m - options.hole_depth_m, top_z_m, options.layer_cut);
  const int wanted = static_cast<int>(std::lround(options.hole_depth_m / frame.cell_m));
  const int64_t layer = flat->frame.CellCount();
  for (int64_t i = 0; i < layer; ++i) {
    int free_count = 0;
    for (int z = band.begin; z < band.end; ++z) {
      const Occupancy cell = grid.cells[z * layer + i];
      free_count += cell == Occupancy::kFree ? 1 : 0;
      if (cell != Occupancy::kOccupied) continue;
      free_count = 0;
      break;
    }
    if (free_count >= wanted) flat->cells[i] = Occupancy::kOccupied;
  }
}

// A thin board that was seen from above and from below leaves nothing but a gap between free
// cells. Where most columns around have one, it is no chance.
void HideBoards(const std::vector<Column>& columns, double column_count, OccupancyGrid* flat) {
  const GridFrame& frame = flat->frame;
  for (int64_t i = 0; i < frame.CellCount(); ++i) {
    if (!columns[i].has_gap || flat->cells[i] != Occupancy::kFree) continue;
    const Eigen::Vector3i cell = frame.Cell(i);
    int count = 0;
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector3i next = cell + Eigen::Vector3i(k % 3 - 1, k / 3 - 1, 0);
      if (!frame.Holds(next)) continue;
      const Column& column = columns[frame.Index(next)];
      count += column.has_gap || column.is_occupied ? 1 : 0;
    }
    if (count >= column_count) flat->cells[i] = Occupancy::kUnknown;
  }
}

GridFrame FlatFrame(const GridFrame& frame, double floor_z_m) {
  GridFrame flat = frame;
  flat.size.z() = 1;
  flat.origin_map.z() = frame.cell_m * std::floor(floor_z_m / frame.cell_m);
  // Rounding must not put the floor below its own grid.
  if (floor_z_m < flat.origin_map.z()) flat.origin_map.z() -= frame.cell_m;
  return flat;
}

}  // namespace

OccupancyGrid ProjectToFloor(const OccupancyGrid& grid, double floor_z_m,
                             const PlaceOptions& options) {
  OccupancyGrid out;
  if (!IsSound(grid) || !std::isfinite(floor_z_m)) return out;
  out.frame = FlatFrame(grid.frame, floor_z_m);
  const int64_t layer = out.frame.CellCount();
  out.cells.assign(layer, Occupancy::kUnknown);
  const Band band = BandBetween(grid.frame, floor_z_m + options.body_z_min_m,
                                floor_z_m + options.body_z_max_m, options.layer_cut);
  if (band.count() == 0) return out;
  const int low_height = (band.count() + 1) / 2;
  std::vector<Column> columns(layer);
  for (int z = band.begin; z < band.end; ++z) {
    const Occupancy* cells = grid.cells.data() + z * layer;
    const bool is_low = z < band.begin + low_height;
    for (int64_t i = 0; i < layer; ++i) {
      columns[i].Add(cells[i], is_low);
    }
  }
  for (int64_t i = 0; i < layer; ++i) {
    out.cells[i] = Judge(columns[i], band.count(), low_height, options.body_seen_share);
  }
  HideBoards(columns, options.board_column_count, &out);
  BlockHoles(grid, floor_z_m, options, &out);
  return out;
}

}  // namespace dsg::ingest
