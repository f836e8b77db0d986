// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>

namespace dsg::ingest {
namespace {

// 21 bits an axis: 50 km of 5 cm voxels either way.
constexpr int64_t kCellLimit = int64_t{1} << 20;

std::optional<uint64_t> PackedCell(const Eigen::Vector3f& point, double voxel_m) {
  if (!point.allFinite()) return std::nullopt;
  uint64_t packed = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const double index = std::floor(static_cast<double>(point[axis]) / voxel_m);
    if (std::abs(index) >= static_cast<double>(kCellLimit)) return std::nullopt;
    packed = packed << 21 | static_cast<uint64_t>(static_cast<int64_t>(index) + kCellLimit);
  }
  return packed;
}

bool HasLabels(const MeshBlock* block) {
  return block != nullptr && block->labels.size() == block->positions_map.size();
}

uint32_t InstanceAt(const MeshBlock& block, size_t vertex) {
  return block.instance_ids.size() == block.positions_map.size() ? block.instance_ids[vertex] : 0;
}

/// The class that most vertices of each instance have; the lowest of equally frequent ones.
std::unordered_map<uint32_t, uint32_t> MajorityLabels(const std::vector<const MeshBlock*>& mesh) {
  std::unordered_map<uint64_t, int64_t> counts;
  for (const MeshBlock* block : mesh) {
    if (!HasLabels(block)) continue;
    for (size_t i = 0; i < block->labels.size(); ++i) {
      const uint32_t instance = InstanceAt(*block, i);
      if (instance == 0 || block->labels[i] == 0) continue;
      ++counts[uint64_t{instance} << 32 | block->labels[i]];
    }
  }
  const std::map<uint64_t, int64_t> sorted(counts.begin(), counts.end());
  std::unordered_map<uint32_t, uint32_t> majority;
  std::unordered_map<uint32_t, int64_t> best_count;
  for (const auto& [key, count] : sorted) {
    const auto instance = static_cast<uint32_t>(key >> 32);
    if (count <= best_count[instance]) continue;
    best_count[instance] = count;
    majority[instance] = static_cast<uint32_t>(key);
  }
  return majority;
}

/// Says which object class and instance a vertex has.
class VertexClassifier {
 public:
  VertexClassifier(const std::vector<const MeshBlock*>& mesh, const std::vector<int32_t>& class_ids)
      : class_ids_(class_ids), majority_(MajorityLabels(mesh)) {}

  /// False for vertices of anything but objects.
  bool Classify(uint32_t label, uint32_t instance, SurfaceVertex* vertex) const {
    const bool is_object = IsObject(label);
    if (!is_object && label != 0) return false;
    vertex->class_id = static_cast<int32_t>(label);
    vertex->instance_id = 0;
    const auto found = instance == 0 ? majority_.end() : majority_.find(instance);
    if (found != majority_.end() && IsObject(found->second)) {
      vertex->class_id = static_cast<int32_t>(found->second);
      vertex->instance_id = instance;
      return true;
    }
    return is_object;
  }

 private:
  bool IsObject(uint32_t label) const {
    return std::binary_search(class_ids_.begin(), class_ids_.end(), static_cast<int32_t>(label));
  }

  const std::vector<int32_t>& class_ids_;
  std::unordered_map<uint32_t, uint32_t> majority_;
};

auto SortKey(const SurfaceVertex& v) {
  return std::tuple(v.class_id, v.cell, v.position_map.x(), v.position_map.y(), v.position_map.z(),
                    v.instance_id, v.color, v.normal_map.x(), v.normal_map.y(), v.normal_map.z());
}

std::vector<SurfaceVertex> GatherVertices(const std::vector<const MeshBlock*>& mesh,
                                          const std::vector<int32_t>& class_ids, double voxel_m,
                                          bool* has_colors) {
  const VertexClassifier classifier(mesh, class_ids);
  std::vector<SurfaceVertex> vertices;
  for (const MeshBlock* block : mesh) {
    if (!HasLabels(block)) continue;
    const bool is_colored = block->colors.size() == block->positions_map.size();
    for (size_t i = 0; i < block->labels.size(); ++i) {
      SurfaceVertex vertex;
      if (!classifier.Classify(block->labels[i], InstanceAt(*block, i), &vertex)) continue;
      const auto cell = PackedCell(block->positions_map[i], voxel_m);
      if (!cell.has_value()) continue;
      vertex.cell = *cell;
      vertex.position_map = block->positions_map[i];
      if (is_colored) vertex.color = block->colors[i];
      *has_colors |= is_colored;
      vertices.push_back(vertex);
    }
  }
  return vertices;
}

std::vector<SurfaceVertex> GatherAllVertices(const std::vector<const MeshBlock*>& mesh,
                                             int32_t class_id, double voxel_m, bool* has_colors) {
  std::vector<SurfaceVertex> vertices;
  for (const MeshBlock* block : mesh) {
    if (block == nullptr) continue;
    const size_t count = block->positions_map.size();
    const bool is_colored = block->colors.size() == count;
    const bool has_normals = block->normals_map.size() == count;
    for (size_t i = 0; i < count; ++i) {
      const auto cell = PackedCell(block->positions_map[i], voxel_m);
      if (!cell.has_value()) continue;
      SurfaceVertex vertex;
      vertex.class_id = class_id;
      vertex.cell = *cell;
      vertex.position_map = block->positions_map[i];
      if (has_normals && block->normals_map[i].allFinite()) {
        vertex.normal_map = block->normals_map[i];
      }
      if (is_colored) vertex.color = block->colors[i];
      *has_colors |= is_colored;
      vertices.push_back(vertex);
    }
  }
  return vertices;
}

// Neighbouring blocks repeat the vertices that they share.
void SortAndThin(std::vector<SurfaceVertex>* vertices) {
  std::sort(vertices->begin(), vertices->end(),
            [](const SurfaceVertex& a, const SurfaceVertex& b) { return SortKey(a) < SortKey(b); });
  const auto is_same = [](const SurfaceVertex& a, const SurfaceVertex& b) {
    return a.class_id == b.class_id && a.position_map == b.position_map &&
           a.instance_id == b.instance_id;
  };
  vertices->erase(std::unique(vertices->begin(), vertices->end(), is_same), vertices->end());
}

SurfaceCell MakeCell(const std::vector<SurfaceVertex>& vertices, size_t begin, size_t end) {
  SurfaceCell cell;
  cell.class_id = vertices[begin].class_id;
  cell.vertex_begin = static_cast<uint32_t>(begin);
  cell.vertex_end = static_cast<uint32_t>(end);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::map<uint32_t, int> counts;
  for (size_t i = begin; i < end; ++i) {
    sum += vertices[i].position_map.cast<double>();
    if (vertices[i].instance_id != 0) ++counts[vertices[i].instance_id];
  }
  int best = 0;
  for (const auto& [instance, count] : counts) {
    if (count <= best) continue;
    best = count;
    cell.instance_id = instance;
  }
  cell.point_map = (sum / static_cast<double>(end - begin)).cast<float>();
  return cell;
}

std::vector<SurfaceCell> MakeCells(const std::vector<SurfaceVertex>& vertices) {
  std::vector<SurfaceCell> cells;
  for (size_t begin = 0; begin < vertices.size();) {
    size_t end = begin + 1;
    while (end < vertices.size() && vertices[end].class_id == vertices[begin].class_id &&
           vertices[end].cell == vertices[begin].cell) {
      ++end;
    }
    cells.push_back(MakeCell(vertices, begin, end));
    begin = end;
  }
  return cells;
}

}  // namespace

ObjectSurface GatherSurface(const std::vector<const MeshBlock*>& mesh,
                            const std::vector<int32_t>& class_ids, double voxel_m) {
  ObjectSurface surface;
  surface.vertices = GatherVertices(mesh, class_ids, voxel_m, &surface.has_colors);
  SortAndThin(&surface.vertices);
  surface.cells = MakeCells(surface.vertices);
  return surface;
}

ObjectSurface GatherAllSurface(const std::vector<const MeshBlock*>& mesh, int32_t class_id,
                               double voxel_m) {
  ObjectSurface surface;
  surface.vertices = GatherAllVertices(mesh, class_id, voxel_m, &surface.has_colors);
  SortAndThin(&surface.vertices);
  surface.cells = MakeCells(surface.vertices);
  return surface;
}

}  // namespace dsg::ingest
