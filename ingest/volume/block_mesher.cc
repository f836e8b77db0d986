// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_mesher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "ingest/volume/cube_table.h"
#include "schema/base/disjoint_sets.h"
#include "schema/model/mesh_grid.h"

namespace dsg::ingest {
namespace {

// Vertices keep off the voxels' centres, or faces would shrink to nothing.
constexpr float kFractionMin = 0.01f;
constexpr uint32_t kNoColor = 0x808080;

const std::array<Eigen::Vector3i, 8>& Corners() {
  static const std::array<Eigen::Vector3i, 8> corners = [] {
    std::array<Eigen::Vector3i, 8> made;
    for (int i = 0; i < 8; ++i) made[i] = {i & 1, i >> 1 & 1, i >> 2};
    return made;
  }();
  return corners;
}

}  // namespace

BlockMesher::BlockMesher(const BlockMap& blocks, const PublishedField& field,
                         const VoxelMeaning& meaning, const InstanceBook& book, double block_size_m)
    : blocks_(blocks), field_(field), meaning_(meaning), book_(book), block_size_m_(block_size_m) {}

MeshBlock BlockMesher::Make(const BlockIndex& index) {
  mesh_ = MeshBlock();
  mesh_.index = index;
  cell_of_face_.clear();
  const Eigen::Vector3d corner =
      Eigen::Vector3d(index.x, index.y, index.z) * (block_size_m_ / blocks_.voxel_m());
  const double width = block_size_m_ / blocks_.voxel_m();
  // Cells that may hold a vertex of the block, one more on all sides, and the far corners.
  low_ = (corner.array() - 1.5).floor().cast<int>() - 1;
  const Eigen::Vector3i last = (corner.array() + width - 0.5).floor().cast<int>() + 2;
  size_ = last - low_ + Eigen::Vector3i::Ones();
  if (!Gather()) return std::move(mesh_);
  vertex_on_edge_.assign(distance_.size() * 3, -1);
  for (int z = 1; z < size_.z() - 2; ++z) {
    for (int y = 1; y < size_.y() - 2; ++y) {
      for (int x = 1; x < size_.x() - 2; ++x) MeshCell({x, y, z});
    }
  }
  DropSpecks();
  return std::move(mesh_);
}

// False when no surface comes near.
bool BlockMesher::Gather() {
  distance_.assign(static_cast<size_t>(size_.prod()), std::numeric_limits<float>::quiet_NaN());
  bool has_surface = false;
  const BlockKey first = BlockMap::KeyOf(low_);
  const BlockKey last = BlockMap::KeyOf(low_ + size_ - Eigen::Vector3i::Ones());
  BlockKey key;
  for (key.z = first.z; key.z <= last.z; ++key.z) {
    for (key.y = first.y; key.y <= last.y; ++key.y) {
      for (key.x = first.x; key.x <= last.x; ++key.x) {
        const VoxelBlock* block = blocks_.Find(key);
        if (block == nullptr || !block->has_surface) continue;
        has_surface = true;
        const Eigen::Vector3i at = Eigen::Vector3i(key.x, key.y, key.z) * VoxelBlock::kSide - low_;
        const Eigen::Vector3i from = (-at).cwiseMax(0);
        const Eigen::Vector3i to = (size_ - at).cwiseMin(VoxelBlock::kSide);
        for (int z = from.z(); z < to.z(); ++z) {
          for (int y = from.y(); y < to.y(); ++y) {
            float* row = &distance_[Offset(at + Eigen::Vector3i(from.x(), y, z))];
            const Voxel* voxel = &block->voxels[VoxelBlock::IndexOf(from.x(), y, z)];
            for (int x = from.x(); x < to.x(); ++x) *row++ = field_.DistanceOf(*voxel++);
          }
        }
      }
    }
  }
  return has_surface;
}

void BlockMesher::MeshCell(const Eigen::Vector3i& cell) {
  std::array<float, 8> corners;
  const float* at = &distance_[Offset(cell)];
  const size_t row = static_cast<size_t>(size_.x());
  const size_t layer = row * static_cast<size_t>(size_.y());
  for (size_t i = 0; i < 8; ++i) corners[i] = at[(i & 1) + (i >> 1 & 1) * row + (i >> 2) * layer];
  const int inside = field_.CaseOf(corners);
  if (inside == 0) return;
  const CubeTable& table = CubeTable::Get();
  for (const std::array<uint8_t, 3>& triangle : table.Triangles(inside)) {
    const CubeEdge& leading = table.edges()[triangle[0]];
    const Eigen::Vector3f point = PointOn(cell + Corners()[leading.low], leading.axis);
    if (BlockOf(point, block_size_m_) != mesh_.index) continue;
    std::array<uint32_t, 3> face;
    for (size_t i = 0; i < 3; ++i) {
      const CubeEdge& edge = table.edges()[triangle[i]];
      face[i] = VertexOf(cell + Corners()[edge.low], edge.axis);
    }
    mesh_.faces.push_back(face);
    cell_of_face_.push_back(low_ + cell);
  }
}

float BlockMesher::FractionOn(size_t low, size_t high) const {
  const float fraction = distance_[low] / (distance_[low] - distance_[high]);
  return std::clamp(fraction, kFractionMin, 1.0f - kFractionMin);
}

Eigen::Vector3f BlockMesher::PointOn(const Eigen::Vector3i& voxel, int axis) const {
  const Eigen::Vector3i next = voxel + Eigen::Vector3i::Unit(axis);
  Eigen::Vector3d at = (voxel + low_).cast<double>().array() + 0.5;
  at[axis] += static_cast<double>(FractionOn(Offset(voxel), Offset(next)));
  return RoundToMeshGrid(at * blocks_.voxel_m());
}

uint32_t BlockMesher::VertexOf(const Eigen::Vector3i& voxel, int axis) {
  int32_t& vertex = vertex_on_edge_[3 * Offset(voxel) + axis];
  if (vertex >= 0) return static_cast<uint32_t>(vertex);
  vertex = static_cast<int32_t>(mesh_.positions_map.size());
  const Eigen::Vector3i next = voxel + Eigen::Vector3i::Unit(axis);
  const float fraction = FractionOn(Offset(voxel), Offset(next));
  mesh_.positions_map.push_back(PointOn(voxel, axis));
  Eigen::Vector3f normal = GradientAt(voxel) * (1.0f - fraction) + GradientAt(next) * fraction;
  const float length = normal.norm();
  const bool is_first_inside = distance_[Offset(voxel)] < 0.0f;
  if (length > 1e-6f) {
    normal /= length;
  } else {
    normal = Eigen::Vector3f::Unit(axis) * (is_first_inside ? 1.0f : -1.0f);
  }
  mesh_.normals_map.push_back(NormalOf(NormalCodeOf(normal)));
  AddMeaning(is_first_inside ? next : voxel, is_first_inside ? voxel : next);
  AddTimes(is_first_inside ? next : voxel, is_first_inside ? voxel : next);
  return static_cast<uint32_t>(vertex);
}

Eigen::Vector3f BlockMesher::GradientAt(const Eigen::Vector3i& voxel) const {
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
  const float here = distance_[Offset(voxel)];
  for (int axis = 0; axis < 3; ++axis) {
    const float before = distance_[Offset(voxel - Eigen::Vector3i::Unit(axis))];
    const float after = distance_[Offset(voxel + Eigen::Vector3i::Unit(axis))];
    if (!std::isnan(before) && !std::isnan(after)) {
      gradient[axis] = 0.5f * (after - before);
    } else if (!std::isnan(after)) {
      gradient[axis] = after - here;
    } else if (!std::isnan(before)) {
      gradient[axis] = here - before;
    }
  }
  return gradient;
}

// The outer voxel first: it was labelled from this side of the surface alone, while the inner one
// of a thin wall is also near the other side.
void BlockMesher::AddMeaning(const Eigen::Vector3i& outside, const Eigen::Vector3i& inside) {
  uint32_t color = kNoColor;
  bool has_color = false;
  uint32_t class_id = 0;
  uint32_t instance_id = 0;
  for (const Eigen::Vector3i& local : {outside, inside}) {
    const Eigen::Vector3i voxel = local + low_;
    const VoxelBlock* block = blocks_.Find(BlockMap::KeyOf(voxel));
    if (block == nullptr) continue;
    const int index = BlockMap::IndexOf(voxel);
    const Voxel& content = block->voxels[index];
    if (!has_color && content.color_count > 0) {
      has_color = true;
      color = static_cast<uint32_t>(content.rgb[0] << 16 | content.rgb[1] << 8 | content.rgb[2]);
    }
    const VoxelLabels* labels = block->LabelsOf(index);
    if (class_id == 0 && labels != nullptr) {
      class_id = meaning_.ClassOf(*labels);
      instance_id = VoxelMeaning::InstanceOf(*labels, class_id, book_);
    }
  }
  if (class_id == 0) AddMeaningAround(outside + low_, &class_id, &instance_id);
  mesh_.colors.push_back(color);
  mesh_.labels.push_back(class_id);
  mesh_.instance_ids.push_back(instance_id);
}

// Of the voxels' blocks: single voxels would take a quarter more memory to tell little more.
void BlockMesher::AddTimes(const Eigen::Vector3i& outside, const Eigen::Vector3i& inside) {
  TimeNs first_ns = kTimeMax;
  TimeNs last_ns = kTimeMin;
  for (const Eigen::Vector3i& local : {outside, inside}) {
    const VoxelBlock* block = blocks_.Find(BlockMap::KeyOf(local + low_));
    if (block == nullptr) continue;
    first_ns = std::min(first_ns, block->first_surface_ns);
    last_ns = std::max(last_ns, block->last_surface_ns);
  }
  mesh_.first_seen_ns.push_back(std::min(first_ns, last_ns));
  mesh_.last_seen_ns.push_back(last_ns);
}

// Pixels beside jumps in depth do not vote, so rims and thin things have voxels without a vote;
// what most voxels around are, they are.
void BlockMesher::AddMeaningAround(const Eigen::Vector3i& voxel, uint32_t* class_id,
                                   uint32_t* instance_id) const {
  std::map<std::pair<uint32_t, uint32_t>, int> counts;
  for (int step = 0; step < 27; ++step) {
    const Eigen::Vector3i near =
        voxel + Eigen::Vector3i(step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1);
    const VoxelBlock* block = blocks_.Find(BlockMap::KeyOf(near));
    const VoxelLabels* labels =
        block == nullptr ? nullptr : block->LabelsOf(BlockMap::IndexOf(near));
    const uint32_t found = labels == nullptr ? 0 : meaning_.ClassOf(*labels);
    if (found != 0) ++counts[{found, VoxelMeaning::InstanceOf(*labels, found, book_)}];
  }
  int most = 0;
  for (const auto& [meaning, count] : counts) {
    if (count <= most) continue;
    most = count;
    std::tie(*class_id, *instance_id) = meaning;
  }
}

void BlockMesher::DropSpecks() {
  DisjointSets parts(mesh_.positions_map.size());
  for (const auto& face : mesh_.faces) {
    for (size_t i = 1; i < 3; ++i) {
      parts.Merge(static_cast<int>(face[0]), static_cast<int>(face[i]));
    }
  }
  const auto part_of = [&](size_t face) {
    return static_cast<size_t>(parts.Find(static_cast<int>(mesh_.faces[face][0])));
  };
  std::vector<int> face_count(parts.size(), 0);
  for (size_t i = 0; i < mesh_.faces.size(); ++i) ++face_count[part_of(i)];
  // Small here may be large beyond the block's border.
  std::map<size_t, bool> is_speck;
  std::vector<uint8_t> is_kept(mesh_.faces.size(), 1);
  bool drops_some = false;
  for (size_t i = 0; i < mesh_.faces.size(); ++i) {
    const size_t part = part_of(i);
    if (face_count[part] >= field_.speck_face_count()) continue;
    auto [found, is_new] = is_speck.try_emplace(part, false);
    if (is_new) found->second = field_.IsSpeck(cell_of_face_[i]);
    if (!found->second) continue;
    is_kept[i] = 0;
    drops_some = true;
  }
  if (drops_some) KeepFaces(is_kept);
}

void BlockMesher::KeepFaces(const std::vector<uint8_t>& is_kept) {
  MeshBlock kept;
  kept.index = mesh_.index;
  std::vector<int32_t> moved(mesh_.positions_map.size(), -1);
  for (size_t i = 0; i < mesh_.faces.size(); ++i) {
    if (is_kept[i] == 0) continue;
    std::array<uint32_t, 3> face = mesh_.faces[i];
    for (uint32_t& vertex : face) {
      if (moved[vertex] < 0) {
        moved[vertex] = static_cast<int32_t>(kept.positions_map.size());
        kept.positions_map.push_back(mesh_.positions_map[vertex]);
        kept.normals_map.push_back(mesh_.normals_map[vertex]);
        kept.colors.push_back(mesh_.colors[vertex]);
        kept.labels.push_back(mesh_.labels[vertex]);
        kept.instance_ids.push_back(mesh_.instance_ids[vertex]);
        kept.first_seen_ns.push_back(mesh_.first_seen_ns[vertex]);
        kept.last_seen_ns.push_back(mesh_.last_seen_ns[vertex]);
      }
      vertex = static_cast<uint32_t>(moved[vertex]);
    }
    kept.faces.push_back(face);
  }
  mesh_ = std::move(kept);
}

}  // namespace dsg::ingest
