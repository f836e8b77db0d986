// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/published_field.h"

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <vector>

#include "ingest/volume/cube_table.h"

namespace dsg::ingest {
namespace {

constexpr int16_t kUnpublished = std::numeric_limits<int16_t>::min();
constexpr float kFullScale = 32000.0f;
// In voxels: the corners of cut cubes are nearer than this.
constexpr float kNearSurface = 1.75f;
// Of the truncation: such distances have been cut, and say nothing of where the surface is.
constexpr float kUncut = 0.99f;

}  // namespace

PublishedField::PublishedField(const BlockMap& blocks, const BandLengths& band,
                               const MeshingOptions& options)
    : blocks_(blocks), band_(band), options_(options), step_m_(band.truncation_m / kFullScale) {}

std::optional<Eigen::AlignedBox3i> PublishedField::Publish(VoxelBlock* block) const {
  const float near_m = kNearSurface * band_.voxel_m;
  const float still = static_cast<float>(options_.still_voxels) * band_.voxel_m / step_m_;
  const Eigen::Vector3i low =
      Eigen::Vector3i(block->key.x, block->key.y, block->key.z) * VoxelBlock::kSide;
  Eigen::AlignedBox3i changed;
  for (int i = 0; i < VoxelBlock::kCount; ++i) {
    Voxel& voxel = block->voxels[i];
    if (!voxel.IsSeen()) continue;
    const float now = voxel.distance_m / step_m_;
    const float before = voxel.published;
    const bool is_new = voxel.published == kUnpublished;
    if (!is_new && std::abs(now - before) <= still) continue;
    voxel.published = static_cast<int16_t>(std::lround(now));
    const bool is_near =
        std::abs(voxel.distance_m) < near_m || (!is_new && std::abs(before) * step_m_ < near_m);
    if (is_near) changed.extend(low + Eigen::Vector3i(i & 7, i >> 3 & 7, i >> 6));
  }
  if (block->label_changed) {
    changed.extend(low);
    changed.extend(low + Eigen::Vector3i::Constant(VoxelBlock::kSide - 1));
  }
  block->label_changed = false;
  if (changed.isEmpty()) return std::nullopt;
  return changed;
}

float PublishedField::DistanceOf(const Voxel& voxel) const {
  if (voxel.published == kUnpublished) return std::numeric_limits<float>::quiet_NaN();
  return static_cast<float>(voxel.published) * step_m_;
}

float PublishedField::At(const Eigen::Vector3i& voxel) const {
  const VoxelBlock* block = blocks_.Find(BlockMap::KeyOf(voxel));
  if (block == nullptr) return std::numeric_limits<float>::quiet_NaN();
  return DistanceOf(block->voxels[BlockMap::IndexOf(voxel)]);
}

int PublishedField::CaseOf(const std::array<float, 8>& corners) const {
  int inside = 0;
  float sum = 0.0f;
  for (int i = 0; i < 8; ++i) {
    inside |= (corners[i] < 0.0f ? 1 : 0) << i;
    sum += corners[i];
  }
  if (inside == 0 || inside == 255 || std::isnan(sum)) return 0;
  const float uncut_m = kUncut * band_.truncation_m;
  const CubeTable& table = CubeTable::Get();
  const int crossed = table.CrossedEdges(inside);
  for (int e = 0; e < 12; ++e) {
    if ((crossed >> e & 1) == 0) continue;
    const CubeEdge& edge = table.edges()[e];
    if (std::abs(corners[edge.low]) > uncut_m || std::abs(corners[edge.high]) > uncut_m) return 0;
  }
  return inside;
}

int PublishedField::CaseAt(const Eigen::Vector3i& cell) const {
  std::array<float, 8> corners;
  for (int i = 0; i < 8; ++i) {
    corners[i] = At(cell + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2));
  }
  return CaseOf(corners);
}

bool PublishedField::IsSpeck(const Eigen::Vector3i& cell) const {
  const CubeTable& table = CubeTable::Get();
  const auto key = [](const Eigen::Vector3i& c) { return std::tuple(c.x(), c.y(), c.z()); };
  std::set<std::tuple<int, int, int>> seen{key(cell)};
  std::vector<Eigen::Vector3i> open{cell};
  int faces = 0;
  while (!open.empty()) {
    const Eigen::Vector3i at = open.back();
    open.pop_back();
    const int inside = CaseAt(at);
    if (inside == 0) continue;
    faces += static_cast<int>(table.Triangles(inside).size());
    if (faces >= options_.speck_face_count) return false;
    const int crossed = table.CrossedEdges(inside);
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2;
      const int side = face % 2;
      bool is_cut = false;
      for (int e = 0; e < 12; ++e) {
        const CubeEdge& edge = table.edges()[e];
        is_cut |= (crossed >> e & 1) != 0 && (edge.low >> axis & 1) == side &&
                  (edge.high >> axis & 1) == side;
      }
      if (!is_cut) continue;
      Eigen::Vector3i next = at;
      next[axis] += side == 1 ? 1 : -1;
      if (seen.insert(key(next)).second) open.push_back(next);
    }
  }
  return true;
}

}  // namespace dsg::ingest
