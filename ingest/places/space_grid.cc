// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/space_grid.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "ingest/grid/distance_transform.h"

namespace dsg::ingest {
namespace {

// Cells of a path, each once, ascending.
std::set<int64_t> CellsOf(const std::vector<Eigen::Vector3d>& path_map, const GridFrame& frame) {
  std::set<int64_t> cells;
  for (const Eigen::Vector3d& point_map : path_map) {
    Eigen::Vector3i cell = frame.CellOf(point_map);
    if (frame.size.z() == 1) cell.z() = 0;
    if (frame.Holds(cell)) cells.insert(frame.Index(cell));
  }
  return cells;
}

std::vector<Eigen::Vector3i> Footprint(const GridFrame& frame, double radius_m) {
  const int reach = static_cast<int>(radius_m / frame.cell_m + 1e-9);
  const int up = frame.size.z() == 1 ? 0 : reach;
  std::vector<Eigen::Vector3i> offsets;
  for (int z = -up; z <= up; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector3i offset(x, y, z);
        const double distance_m = frame.cell_m * offset.cast<double>().norm();
        if (distance_m <= radius_m + 1e-9) offsets.push_back(offset);
      }
    }
  }
  return offsets;
}

// Neighbours of a cell in its row, its plane and, unless the grid is flat, its column.
std::vector<Eigen::Vector3i> Box(const GridFrame& frame) {
  const int up = frame.size.z() == 1 ? 0 : 1;
  std::vector<Eigen::Vector3i> offsets;
  for (int z = -up; z <= up; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) offsets.emplace_back(x, y, z);
    }
  }
  return offsets;
}

// Unknown cells that have as many unknown neighbours as the corner of a block of them.
bool IsUnknownSpace(const OccupancyGrid& grid, const Eigen::Vector3i& cell,
                    const std::vector<Eigen::Vector3i>& box) {
  const int wanted = grid.frame.size.z() == 1 ? 4 : 8;
  int count = 0;
  for (const Eigen::Vector3i& offset : box) {
    count += grid.At(cell + offset) == Occupancy::kUnknown ? 1 : 0;
    if (count >= wanted) return true;
  }
  return false;
}

}  // namespace

bool IsSound(const OccupancyGrid& grid) {
  const GridFrame& frame = grid.frame;
  const bool is_placed = frame.origin_map.allFinite() && std::isfinite(frame.cell_m) &&
                         frame.cell_m > 1e-3 &&
                         (frame.origin_map.array().abs() < GridFrame::kCellMax * 1e-3).all();
  return is_placed && CanMeasure(frame) && frame.CellCount() > 0 &&
         static_cast<int64_t>(grid.cells.size()) == frame.CellCount();
}

void StampPath(const std::vector<Eigen::Vector3d>& path_map, double footprint_m,
               OccupancyGrid* grid) {
  const GridFrame& frame = grid->frame;
  const std::vector<Eigen::Vector3i> footprint = Footprint(frame, footprint_m);
  std::set<int64_t> freed;
  for (const int64_t index : CellsOf(path_map, frame)) {
    const Eigen::Vector3i at = frame.Cell(index);
    size_t occupied_count = 0;
    for (const Eigen::Vector3i& offset : footprint) {
      occupied_count += grid->At(at + offset) == Occupancy::kOccupied ? 1 : 0;
    }
    if (3 * occupied_count > footprint.size()) continue;
    for (const Eigen::Vector3i& offset : footprint) {
      if (frame.Holds(at + offset)) freed.insert(frame.Index(at + offset));
    }
  }
  for (const int64_t index : freed) grid->cells[index] = Occupancy::kFree;
}

void KeepReached(const std::vector<Eigen::Vector3d>& path_map, OccupancyGrid* grid) {
  const GridFrame& frame = grid->frame;
  std::vector<uint8_t> is_reached(grid->cells.size(), 0);
  std::vector<int64_t> open;
  const auto reach = [&](int64_t index) {
    if (grid->cells[index] != Occupancy::kFree || is_reached[index] != 0) return;
    is_reached[index] = 1;
    open.push_back(index);
  };
  for (const int64_t index : CellsOf(path_map, frame)) reach(index);
  if (open.empty()) return;
  const int64_t layer = int64_t{frame.size.x()} * frame.size.y();
  while (!open.empty()) {
    const int64_t index = open.back();
    open.pop_back();
    const Eigen::Vector3i cell = frame.Cell(index);
    if (cell.x() > 0) reach(index - 1);
    if (cell.x() + 1 < frame.size.x()) reach(index + 1);
    if (cell.y() > 0) reach(index - frame.size.x());
    if (cell.y() + 1 < frame.size.y()) reach(index + frame.size.x());
    if (cell.z() > 0) reach(index - layer);
    if (cell.z() + 1 < frame.size.z()) reach(index + layer);
  }
  for (size_t i = 0; i < is_reached.size(); ++i) {
    if (grid->cells[i] == Occupancy::kFree && is_reached[i] == 0) {
      grid->cells[i] = Occupancy::kUnknown;
    }
  }
}

void ShrinkFromUnknown(OccupancyGrid* grid) {
  const GridFrame& frame = grid->frame;
  const std::vector<Eigen::Vector3i> box = Box(frame);
  std::vector<int64_t> lost;
  for (int64_t index = 0; index < frame.CellCount(); ++index) {
    if (grid->cells[index] != Occupancy::kFree) continue;
    const Eigen::Vector3i cell = frame.Cell(index);
    for (const Eigen::Vector3i& offset : box) {
      const Eigen::Vector3i next = cell + offset;
      if (grid->At(next) != Occupancy::kUnknown || !IsUnknownSpace(*grid, next, box)) continue;
      lost.push_back(index);
      break;
    }
  }
  for (const int64_t index : lost) grid->cells[index] = Occupancy::kUnknown;
}

}  // namespace dsg::ingest
