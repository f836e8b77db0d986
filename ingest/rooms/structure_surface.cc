// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/structure_surface.h"

#include <array>
#include <bit>
#include <cmath>

namespace dsg::ingest {
namespace {

using Face = std::array<uint32_t, 3>;

/// Finds vertices again by the bits of their positions. Open addressing: a mesh of a building has
/// millions of vertices.
class Welder {
 public:
  explicit Welder(size_t count) : slots_(std::bit_ceil(2 * count + 16), kNone) {}

  /// Index of the position, added when it is new.
  uint32_t Find(const Eigen::Vector3f& position, std::vector<Eigen::Vector3f>* positions) {
    // Adding zero makes both zeros one.
    const Eigen::Vector3f key = position + Eigen::Vector3f::Zero();
    uint64_t hash = 0x9E3779B97F4A7C15u;
    for (int axis = 0; axis < 3; ++axis) {
      hash = (hash ^ std::bit_cast<uint32_t>(key[axis])) * 0xBF58476D1CE4E5B9u;
      hash ^= hash >> 29;
    }
    size_t slot = hash & (slots_.size() - 1);
    while (slots_[slot] != kNone) {
      if ((*positions)[slots_[slot]] == key) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<uint32_t>(positions->size());
    positions->push_back(key);
    return slots_[slot];
  }

 private:
  static constexpr uint32_t kNone = 0xFFFFFFFFu;
  std::vector<uint32_t> slots_;
};

class Joiner {
 public:
  Joiner(const std::vector<const MeshBlock*>& mesh, double smooth_cosine)
      : mesh_(mesh), smooth_cosine_(static_cast<float>(smooth_cosine)) {}

  StructureSurface Join() {
    size_t vertex_count = 0;
    size_t face_count = 0;
    for (const MeshBlock* block : mesh_) {
      if (block == nullptr) continue;
      vertex_count += block->positions_map.size();
      face_count += block->faces.size();
    }
    Welder welder(vertex_count);
    surface_.positions_map.reserve(vertex_count);
    faces_.reserve(face_count);
    for (const MeshBlock* block : mesh_) {
      if (block != nullptr) AddBlock(*block, &welder);
    }
    AddFaces();
    LinkNeighbours();
    NormalizeAll();
    for (int round = 0; round < 2; ++round) Smooth();
    return std::move(surface_);
  }

 private:
  void AddBlock(const MeshBlock& block, Welder* welder) {
    constexpr uint32_t kLost = 0xFFFFFFFFu;
    const size_t count = block.positions_map.size();
    const bool has_normals = block.normals_map.size() == count;
    const bool has_labels = block.labels.size() == count;
    std::vector<uint32_t> index(count, kLost);
    for (size_t i = 0; i < count; ++i) {
      if (!block.positions_map[i].allFinite()) continue;
      index[i] = welder->Find(block.positions_map[i], &surface_.positions_map);
      if (index[i] == surface_.normals_map.size()) {
        surface_.normals_map.emplace_back(Eigen::Vector3f::Zero());
        surface_.class_ids.push_back(has_labels ? static_cast<int32_t>(block.labels[i]) : -1);
      }
      if (has_normals && block.normals_map[i].allFinite()) {
        surface_.normals_map[index[i]] = block.normals_map[i];
      }
    }
    for (const Face& face : block.faces) {
      if (face[0] >= count || face[1] >= count || face[2] >= count) continue;
      const Face joined = {index[face[0]], index[face[1]], index[face[2]]};
      const bool is_lost = joined[0] == kLost || joined[1] == kLost || joined[2] == kLost;
      const bool is_flat =
          joined[0] == joined[1] || joined[1] == joined[2] || joined[2] == joined[0];
      if (!is_lost && !is_flat) faces_.push_back(joined);
    }
  }

  void AddFaces() {
    const size_t count = surface_.positions_map.size();
    surface_.areas_m2.assign(count, 0.0f);
    std::vector<Eigen::Vector3f> of_faces(count, Eigen::Vector3f::Zero());
    for (const Face& face : faces_) {
      const Eigen::Vector3f& a = surface_.positions_map[face[0]];
      const Eigen::Vector3f cross =
          (surface_.positions_map[face[1]] - a).cross(surface_.positions_map[face[2]] - a);
      const float third = cross.norm() / 6.0f;
      for (const uint32_t vertex : face) {
        of_faces[vertex] += cross;
        surface_.areas_m2[vertex] += third;
      }
    }
    for (size_t i = 0; i < count; ++i) {
      if (surface_.normals_map[i].isZero()) surface_.normals_map[i] = of_faces[i];
    }
  }

  void LinkNeighbours() {
    const size_t count = surface_.positions_map.size();
    surface_.first.assign(count + 1, 0);
    for (const Face& face : faces_) {
      for (const uint32_t vertex : face) surface_.first[vertex + 1] += 2;
    }
    for (size_t i = 0; i < count; ++i) surface_.first[i + 1] += surface_.first[i];
    surface_.neighbours.resize(surface_.first[count]);
    std::vector<uint32_t> next(surface_.first.begin(), surface_.first.end() - 1);
    for (const Face& face : faces_) {
      for (size_t corner = 0; corner < 3; ++corner) {
        surface_.neighbours[next[face[corner]]++] = face[(corner + 1) % 3];
        surface_.neighbours[next[face[corner]]++] = face[(corner + 2) % 3];
      }
    }
  }

  void NormalizeAll() {
    for (Eigen::Vector3f& normal : surface_.normals_map) {
      const float length = normal.norm();
      normal = length > 0.0f ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::Zero();
    }
  }

  // Neighbours around the corner do not count, so that edges stay sharp.
  void Smooth() {
    const std::vector<Eigen::Vector3f> before = surface_.normals_map;
    for (uint32_t i = 0; i < before.size(); ++i) {
      Eigen::Vector3f sum = 2.0f * before[i];
      for (const uint32_t other : surface_.NeighboursOf(i)) {
        if (before[i].dot(before[other]) > smooth_cosine_) sum += before[other];
      }
      surface_.normals_map[i] = sum;
    }
    NormalizeAll();
  }

  const std::vector<const MeshBlock*>& mesh_;
  const float smooth_cosine_;
  StructureSurface surface_;
  std::vector<Face> faces_;
};

}  // namespace

StructureSurface JoinBlocks(const std::vector<const MeshBlock*>& mesh, double smooth_cosine) {
  return Joiner(mesh, smooth_cosine).Join();
}

}  // namespace dsg::ingest
