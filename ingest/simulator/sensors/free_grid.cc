// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/free_grid.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace dsg::simulator {
namespace {

using truth::FreeGrid;

constexpr double kCellM = 0.1;
constexpr float kBodyLowM = 0.1f;
constexpr float kBodyHighM = 1.8f;
constexpr double kDoorBandM = 0.4;

struct Cell {
  int column = 0;
  int row = 0;
};

Cell CellOf(const FreeGrid& grid, double x, double y) {
  return {static_cast<int>(std::floor((x - grid.origin_map.x()) / grid.cell_m)),
          static_cast<int>(std::floor((y - grid.origin_map.y()) / grid.cell_m))};
}

bool Holds(const FreeGrid& grid, const Cell& cell) {
  return cell.column >= 0 && cell.row >= 0 && cell.column < grid.width && cell.row < grid.height;
}

size_t IndexOf(const FreeGrid& grid, const Cell& cell) {
  return static_cast<size_t>(cell.row) * static_cast<size_t>(grid.width) +
         static_cast<size_t>(cell.column);
}

// Marks the cells under the part of a triangle that lies in the height band, by points closer
// together than half a cell.
void MarkTriangle(const FreeGrid& grid, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                  const Eigen::Vector3f& c, std::vector<uint8_t>* occupied) {
  const float top = std::max({a.z(), b.z(), c.z()});
  const float bottom = std::min({a.z(), b.z(), c.z()});
  if (top < kBodyLowM || bottom > kBodyHighM) return;
  const float longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
  const int steps = std::max(1, static_cast<int>(std::ceil(longest / (0.5f * 0.9f * kCellM))));
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; i + j <= steps; ++j) {
      const float u = static_cast<float>(i) / static_cast<float>(steps);
      const float v = static_cast<float>(j) / static_cast<float>(steps);
      const Eigen::Vector3f point = a + u * (b - a) + v * (c - a);
      if (point.z() < kBodyLowM || point.z() > kBodyHighM) continue;
      const Cell cell = CellOf(grid, point.x(), point.y());
      if (Holds(grid, cell)) (*occupied)[IndexOf(grid, cell)] = 1;
    }
  }
}

// 4-connected, so that it does not slip through the corner of two walls.
void FloodFree(const std::vector<uint8_t>& occupied, const Cell& start, FreeGrid* grid) {
  std::vector<Cell> open;
  const auto visit = [&](const Cell& cell) {
    if (!Holds(*grid, cell)) return;
    const size_t index = IndexOf(*grid, cell);
    if (occupied[index] != 0 || (grid->cells[index] & truth::kCellFree) != 0) return;
    grid->cells[index] |= truth::kCellFree;
    open.push_back(cell);
  };
  visit(start);
  while (!open.empty()) {
    const Cell cell = open.back();
    open.pop_back();
    visit({cell.column + 1, cell.row});
    visit({cell.column - 1, cell.row});
    visit({cell.column, cell.row + 1});
    visit({cell.column, cell.row - 1});
  }
}

void MarkDoorBands(const FloorPlan& plan, FreeGrid* grid) {
  for (const Door& door : plan.doors) {
    const Rect opening = door.Opening();
    const Rect band = Inflate(opening, kDoorBandM);
    const Cell low = CellOf(*grid, band.min().x(), band.min().y());
    const Cell high = CellOf(*grid, band.max().x(), band.max().y());
    for (int row = low.row; row <= high.row; ++row) {
      for (int column = low.column; column <= high.column; ++column) {
        if (!Holds(*grid, {column, row})) continue;
        const Point middle = grid->origin_map + grid->cell_m * Point(column + 0.5, row + 0.5);
        if (DistanceToRect(middle, opening) > kDoorBandM) continue;
        grid->cells[IndexOf(*grid, {column, row})] |= truth::kCellDoorBand;
      }
    }
  }
}

}  // namespace

FreeGrid MakeFreeGrid(const World& world, const Scene& scene, const Point& inside) {
  FreeGrid grid;
  const Rect bounds = world.Bounds();
  grid.cell_m = kCellM;
  grid.origin_map = bounds.min();
  grid.width = static_cast<int>(std::ceil(bounds.sizes().x() / kCellM - 1e-9));
  grid.height = static_cast<int>(std::ceil(bounds.sizes().y() / kCellM - 1e-9));
  const size_t count = static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height);
  grid.cells.assign(count, 0);
  std::vector<uint8_t> occupied(count, 0);
  for (const Part& part : scene.parts) {
    const std::vector<Eigen::Vector3f>& points = part.mesh.vertices;
    for (const std::array<uint32_t, 3>& face : part.mesh.faces) {
      MarkTriangle(grid, points[face[0]], points[face[1]], points[face[2]], &occupied);
    }
  }
  FloodFree(occupied, CellOf(grid, inside.x(), inside.y()), &grid);
  MarkDoorBands(world.plan, &grid);
  return grid;
}

}  // namespace dsg::simulator
