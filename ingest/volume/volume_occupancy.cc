// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/volume_occupancy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace dsg::ingest {
namespace {

constexpr double kCellCountMax = 3e8;

// Low corner and first beyond the high one, in blocks, of the middle `1 - 2 * tail` of the blocks
// on each axis.
struct BlockRange {
  Eigen::Vector3i low;
  Eigen::Vector3i end;
};

BlockRange MiddleOf(const std::array<std::vector<int>, 3>& sorted, double tail) {
  BlockRange range;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<int>& keys = sorted[axis];
    const auto skipped = static_cast<size_t>(tail * static_cast<double>(keys.size()));
    range.low[axis] = keys[skipped];
    range.end[axis] = keys[keys.size() - 1 - skipped] + 1;
  }
  return range;
}

GridFrame MakeFrame(const BlockMap& blocks, int voxels_per_cell) {
  std::array<std::vector<int>, 3> sorted;
  for (int64_t i = 0; i < blocks.size(); ++i) {
    const BlockKey& key = blocks.key(i);
    sorted[0].push_back(key.x);
    sorted[1].push_back(key.y);
    sorted[2].push_back(key.z);
  }
  for (std::vector<int>& keys : sorted) std::sort(keys.begin(), keys.end());
  GridFrame frame;
  frame.cell_m = blocks.voxel_m() * voxels_per_cell;
  // A jump of the pose may have left blocks at the other end of the world.
  for (const double tail : {0.0, 0.001, 0.01, 0.05, 0.25, 0.4999}) {
    const BlockRange range = MiddleOf(sorted, tail);
    const double cells_per_block = static_cast<double>(VoxelBlock::kSide) / voxels_per_cell;
    const Eigen::Vector3i low =
        (range.low.cast<double>() * cells_per_block).array().floor().cast<int>();
    const Eigen::Vector3i end =
        (range.end.cast<double>() * cells_per_block).array().ceil().cast<int>();
    frame.origin_map = low.cast<double>() * frame.cell_m;
    frame.size = end - low;
    if ((end - low).cast<double>().prod() <= kCellCountMax) return frame;
  }
  frame.size.setZero();
  return frame;
}

Occupancy OccupancyOf(VoxelState state) {
  if (state == VoxelState::kUnseen) return Occupancy::kUnknown;
  return state == VoxelState::kInside ? Occupancy::kOccupied : Occupancy::kFree;
}

}  // namespace

int64_t CountBlocksOutside(const BlockMap& blocks, const GridFrame& frame) {
  int64_t count = 0;
  for (int64_t i = 0; i < blocks.size(); ++i) {
    const BlockKey& key = blocks.key(i);
    const Eigen::Vector3d middle_map =
        (Eigen::Vector3d(key.x, key.y, key.z).array() + 0.5) * VoxelBlock::kSide * blocks.voxel_m();
    if (!frame.Holds(frame.CellOf(middle_map))) ++count;
  }
  return count;
}

OccupancyGrid MakeVolumeOccupancy(const BlockMap& blocks, double cell_m) {
  OccupancyGrid grid;
  const int per_cell = std::max(1, static_cast<int>(std::lround(cell_m / blocks.voxel_m())));
  grid.frame.cell_m = blocks.voxel_m() * per_cell;
  if (blocks.size() == 0) return grid;
  grid.frame = MakeFrame(blocks, per_cell);
  const Eigen::Vector3i origin =
      (grid.frame.origin_map / grid.frame.cell_m).array().round().cast<int>();
  grid.cells.assign(static_cast<size_t>(grid.frame.CellCount()), Occupancy::kUnknown);
  // At most one count per voxel of the cell; a cell of many voxels needs no exact one.
  std::vector<uint16_t> free_count(per_cell > 1 ? grid.cells.size() : 0, 0);
  const int half = std::min((per_cell * per_cell * per_cell + 1) / 2, 65535);
  const auto floor_divide = [per_cell](int a) {
    return a >= 0 ? a / per_cell : -((-a + per_cell - 1) / per_cell);
  };
  for (int64_t i = 0; i < blocks.size(); ++i) {
    const BlockMap::States states = blocks.StatesOf(i);
    const BlockKey& key = blocks.key(i);
    const Eigen::Vector3i low = Eigen::Vector3i(key.x, key.y, key.z) * VoxelBlock::kSide;
    for (int j = 0; j < VoxelBlock::kCount; ++j) {
      const Occupancy state = OccupancyOf(states[j]);
      if (state == Occupancy::kUnknown) continue;
      const Eigen::Vector3i voxel = low + Eigen::Vector3i(j & 7, j >> 3 & 7, j >> 6);
      const Eigen::Vector3i cell = voxel.unaryExpr(floor_divide) - origin;
      if (!grid.frame.Holds(cell)) continue;
      const int64_t at = grid.frame.Index(cell);
      if (state == Occupancy::kOccupied || per_cell == 1) {
        grid.cells[at] = state;
      } else if (free_count[at] < half && ++free_count[at] == half &&
                 grid.cells[at] == Occupancy::kUnknown) {
        grid.cells[at] = Occupancy::kFree;
      }
    }
  }
  return grid;
}

}  // namespace dsg::ingest
