// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/places/plan_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "ingest/simulator/scene/scene.h"
#include "ingest/simulator/sensors/free_grid.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr double kCellM = 0.1;
constexpr double kBodyZ = 1.2;

// Cells whose middle is within a voxel of a noisy point of the surface.
void AddPoint(const Eigen::Vector3d& point_map, OccupancyGrid* grid) {
  const Eigen::Vector3i at = grid->frame.CellOf(point_map);
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i cell = at + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    if (!grid->frame.Holds(cell)) continue;
    const bool is_near = (grid->frame.Center(cell) - point_map).norm() < kCellM;
    if (is_near) grid->cells[grid->frame.Index(cell)] = Occupancy::kOccupied;
  }
}

// What is left of the noise of many frames: the same over half a metre of a surface.
class SmoothNoise {
 public:
  SmoothNoise(uint64_t seed, double sigma_m) : random_(seed, 7), sigma_m_(sigma_m) {}
  double At(const Eigen::Vector3d& point_map) {
    const Eigen::Vector3i patch = (2.0 * point_map).array().floor().cast<int>();
    const auto [found, is_new] = of_patch_.try_emplace({patch.x(), patch.y(), patch.z()}, 0.0);
    if (is_new) found->second = sigma_m_ * random_.Normal();
    return found->second;
  }

 private:
  Random random_;
  double sigma_m_;
  std::map<std::array<int, 3>, double> of_patch_;
};

void AddTriangle(const std::array<Eigen::Vector3d, 3>& corners, SmoothNoise* noise,
                 OccupancyGrid* grid) {
  const Eigen::Vector3d& a = corners[0];
  const Eigen::Vector3d ab = corners[1] - a;
  const Eigen::Vector3d ac = corners[2] - a;
  const Eigen::Vector3d normal = ab.cross(ac).normalized();
  if (!normal.allFinite()) return;
  const double longest_m = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
  const int steps = std::max(1, static_cast<int>(std::ceil(longest_m / 0.08)));
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; i + j <= steps; ++j) {
      const Eigen::Vector3d on = a + ab * i / steps + ac * j / steps;
      AddPoint(on + noise->At(on) * normal, grid);
    }
  }
}

// From the path through cells that are not occupied; the rest was never seen.
void FloodFree(const std::vector<Eigen::Vector3d>& path_map, OccupancyGrid* grid) {
  std::vector<int64_t> open;
  const auto visit = [&](const Eigen::Vector3i& cell) {
    if (!grid->frame.Holds(cell)) return;
    Occupancy& occupancy = grid->cells[grid->frame.Index(cell)];
    if (occupancy != Occupancy::kUnknown) return;
    occupancy = Occupancy::kFree;
    open.push_back(grid->frame.Index(cell));
  };
  for (const Eigen::Vector3d& point_map : path_map) visit(grid->frame.CellOf(point_map));
  while (!open.empty()) {
    const Eigen::Vector3i cell = grid->frame.Cell(open.back());
    open.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) visit(cell + step * Eigen::Vector3i::Unit(axis));
    }
  }
}

// There and back along a tree of the world's own walks, so that it comes to every place.
void Drive(const simulator::World& world, const std::vector<std::vector<int>>& next, int place,
           std::vector<bool>* is_known, std::vector<Eigen::Vector3d>* path_map) {
  (*is_known)[static_cast<size_t>(place)] = true;
  const simulator::Point from = world.places.places[static_cast<size_t>(place)].position;
  for (const int other : next[static_cast<size_t>(place)]) {
    if ((*is_known)[static_cast<size_t>(other)]) continue;
    const simulator::Point to = world.places.places[static_cast<size_t>(other)].position;
    for (int step = 0; step <= 20; ++step) {
      const simulator::Point at = from + (to - from) * step / 20.0;
      path_map->emplace_back(at.x(), at.y(), kBodyZ);
    }
    Drive(world, next, other, is_known, path_map);
  }
}

std::vector<Eigen::Vector3d> DrivePath(const simulator::World& world) {
  std::vector<bool> is_known(world.places.places.size(), false);
  std::vector<Eigen::Vector3d> path_map;
  Drive(world, world.places.Neighbours(), 0, &is_known, &path_map);
  return path_map;
}

}  // namespace

OccupancyGrid MakeHall(const Eigen::Vector3d& size_m) {
  OccupancyGrid grid;
  grid.frame.cell_m = kCellM;
  grid.frame.origin_map = Eigen::Vector3d(0.0, 0.0, -kCellM);
  grid.frame.size = (size_m / kCellM).array().round().cast<int>();
  grid.frame.size.z() += 1;
  grid.cells.assign(grid.frame.CellCount(), Occupancy::kFree);
  const int64_t layer = int64_t{grid.frame.size.x()} * grid.frame.size.y();
  std::fill_n(grid.cells.begin(), layer, Occupancy::kOccupied);
  return grid;
}

void Fill(const Eigen::Vector3d& low_map, const Eigen::Vector3d& high_map, Occupancy with,
          OccupancyGrid* grid) {
  for (int64_t i = 0; i < grid->frame.CellCount(); ++i) {
    const Eigen::Vector3d middle = grid->frame.Center(grid->frame.Cell(i));
    const bool is_in =
        (middle.array() > low_map.array()).all() && (middle.array() < high_map.array()).all();
    if (is_in) grid->cells[i] = with;
  }
}

PlanMap MapPlan(simulator::WorldKind kind, uint64_t seed, double noise_m) {
  const simulator::World world = *simulator::GenerateWorld({kind, seed});
  const simulator::Scene scene = simulator::BuildScene(world, {});
  PlanMap map;
  map.truth = simulator::MakeFreeGrid(world, scene, world.places.places.front().position);
  for (uint8_t& cell : map.truth.cells) cell |= truth::kCellObserved;
  map.path_map = DrivePath(world);
  const simulator::Rect bounds = world.Bounds();
  GridFrame& frame = map.grid.frame;
  frame.cell_m = kCellM;
  frame.origin_map.head<2>() = kCellM * (bounds.min() / kCellM).array().floor() - 2.0 * kCellM;
  frame.origin_map.z() = -2.0 * kCellM;
  frame.size.head<2>() = (bounds.sizes() / kCellM).array().ceil().cast<int>() + 4;
  frame.size.z() = static_cast<int>(std::ceil(world.plan.ceiling_m / kCellM)) + 4;
  map.grid.cells.assign(frame.CellCount(), Occupancy::kUnknown);
  SmoothNoise noise(seed, noise_m);
  for (const simulator::Part& part : scene.parts) {
    for (const std::array<uint32_t, 3>& face : part.mesh.faces) {
      AddTriangle(
          {part.mesh.vertices[face[0]].cast<double>(), part.mesh.vertices[face[1]].cast<double>(),
           part.mesh.vertices[face[2]].cast<double>()},
          &noise, &map.grid);
    }
  }
  FloodFree(map.path_map, &map.grid);
  return map;
}

evaluation::PlaceResult Score(const PlaceGraph& graph, const truth::FreeGrid& truth) {
  std::vector<evaluation::EstimatedPlace> places;
  for (const Place& place : graph.places) {
    places.push_back({place.position_map, place.clearance_m});
  }
  std::vector<evaluation::PlaceEdge> edges;
  for (const PlaceLink& link : graph.links) edges.emplace_back(link.from, link.to);
  const evaluation::GridMap map(&truth);
  return evaluation::EvaluatePlaces(places, edges, map, {});
}

}  // namespace dsg::ingest
