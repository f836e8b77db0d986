// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/cell_graph.h"

#include <algorithm>
#include <unordered_map>

#include "ingest/objects/cell_normals.h"

namespace dsg::ingest {
namespace {

// A second one makes up for cells whose first neighbours were noise.
constexpr int kSmoothingRounds = 2;

uint64_t VoxelOf(const ObjectSurface& surface, const SurfaceCell& cell) {
  return surface.vertices[cell.vertex_begin].cell;
}

void LinkNeighbours(const ObjectSurface& surface, CellGraph* graph) {
  std::unordered_map<uint64_t, int> cell_of;
  cell_of.reserve(2 * surface.cells.size());
  for (size_t i = 0; i < surface.cells.size(); ++i) {
    cell_of[VoxelOf(surface, surface.cells[i])] = static_cast<int>(i);
  }
  graph->first.assign(1, 0);
  for (const SurfaceCell& cell : surface.cells) {
    const uint64_t key = VoxelOf(surface, cell);
    for (int64_t z = -1; z <= 1; ++z) {
      for (int64_t y = -1; y <= 1; ++y) {
        for (int64_t x = -1; x <= 1; ++x) {
          if (x == 0 && y == 0 && z == 0) continue;
          // Keys are 21 bits an axis, and cells are far from their ends.
          const auto found = cell_of.find(key + static_cast<uint64_t>(x + y * (1 << 21)) +
                                          static_cast<uint64_t>(z * (int64_t{1} << 42)));
          if (found != cell_of.end()) graph->neighbours.push_back(found->second);
        }
      }
    }
    std::sort(graph->neighbours.begin() + graph->first.back(), graph->neighbours.end());
    graph->first.push_back(static_cast<int>(graph->neighbours.size()));
  }
}

// Neighbours around a corner do not count, so that edges stay sharp.
void SmoothNormals(double same_face_cosine, CellGraph* graph) {
  std::vector<Eigen::Vector3f> smooth = graph->normals_map;
  for (int cell = 0; cell < static_cast<int>(graph->size()); ++cell) {
    const Eigen::Vector3d own = graph->normals_map[static_cast<size_t>(cell)].cast<double>();
    if (own.isZero()) continue;
    Eigen::Vector3d sum = 2.0 * own;
    for (const int other : graph->NeighboursOf(cell)) {
      if (graph->CosineOf(cell, other) > same_face_cosine) sum += graph->NormalAs(own, other);
    }
    smooth[static_cast<size_t>(cell)] = sum.normalized().cast<float>();
  }
  graph->normals_map.swap(smooth);
}

}  // namespace

CellGraph MakeCellGraph(const ObjectSurface& surface, double cell_m, double same_face_cosine) {
  CellGraph graph;
  graph.cell_m = cell_m;
  for (const SurfaceCell& cell : surface.cells) {
    graph.points_map.push_back(cell.point_map);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (uint32_t i = cell.vertex_begin; i < cell.vertex_end; ++i) {
      sum += surface.vertices[i].normal_map;
    }
    graph.normals_map.push_back(sum.norm() < 1e-3f ? Eigen::Vector3f(Eigen::Vector3f::Zero())
                                                   : Eigen::Vector3f(sum.normalized()));
  }
  LinkNeighbours(surface, &graph);
  const auto is_unknown = [](const Eigen::Vector3f& normal) { return normal.isZero(); };
  if (std::all_of(graph.normals_map.begin(), graph.normals_map.end(), is_unknown)) {
    graph.is_oriented = false;
    EstimateNormals(&graph);
  }
  for (int round = 0; round < kSmoothingRounds; ++round) SmoothNormals(same_face_cosine, &graph);
  return graph;
}

}  // namespace dsg::ingest
