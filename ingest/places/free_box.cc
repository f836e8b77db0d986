// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/free_box.h"

#include <array>

namespace dsg::ingest {
namespace {

struct CellBox {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
};

bool IsFree(const OccupancyGrid& grid, const CellBox& box) {
  for (int z = box.low.z(); z <= box.high.z(); ++z) {
    for (int y = box.low.y(); y <= box.high.y(); ++y) {
      for (int x = box.low.x(); x <= box.high.x(); ++x) {
        if (grid.At({x, y, z}) != Occupancy::kFree) return false;
      }
    }
  }
  return true;
}

// One cell further on one side, if all new cells are free.
bool Grow(const OccupancyGrid& grid, int side, CellBox* box) {
  const int axis = side / 2;
  const bool is_up = side % 2 == 1;
  CellBox slice = *box;
  const int at = is_up ? box->high[axis] + 1 : box->low[axis] - 1;
  slice.low[axis] = at;
  slice.high[axis] = at;
  if (!IsFree(grid, slice)) return false;
  (is_up ? box->high : box->low)[axis] = at;
  return true;
}

}  // namespace

Box3d GrowFreeBox(const OccupancyGrid& grid, const Eigen::Vector3i& cell, double reach_m) {
  if (grid.At(cell) != Occupancy::kFree) return {};
  CellBox box{cell, cell};
  std::array<bool, 6> can_grow = {true, true, true, true, true, true};
  const int reach = static_cast<int>(reach_m / grid.frame.cell_m);
  for (int round = 0; round < reach; ++round) {
    for (int side = 0; side < 6; ++side) {
      bool& can = can_grow[static_cast<size_t>(side)];
      can = can && Grow(grid, side, &box);
    }
  }
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid.frame.cell_m);
  return {grid.frame.Center(box.low) - half, grid.frame.Center(box.high) + half};
}

}  // namespace dsg::ingest
