// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/mesh_surface.h"

#include <cmath>
#include <limits>
#include <utility>

#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {

Box3d BoxOf(BlockIndex index, double block_size_m) {
  const Eigen::Vector3d low(index.x * block_size_m, index.y * block_size_m, index.z * block_size_m);
  return Box3d(low, low.array() + block_size_m);
}

std::vector<BlockIndex> BlocksIn(const Box3d& box, double block_size_m) {
  const BlockIndex low = BlockOf(box.min().cast<float>(), block_size_m);
  const BlockIndex high = BlockOf(box.max().cast<float>(), block_size_m);
  std::vector<BlockIndex> blocks;
  for (int32_t x = low.x; x <= high.x; ++x) {
    for (int32_t y = low.y; y <= high.y; ++y) {
      for (int32_t z = low.z; z <= high.z; ++z) blocks.push_back({x, y, z});
    }
  }
  return blocks;
}

absl::StatusOr<std::shared_ptr<const MeshBlock>> BlockCache::Read(BlockIndex index) {
  const auto found = by_index_.find(index);
  if (found != by_index_.end()) {
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().second;
  }
  const auto anew = read_anew_.find(index);
  const Snapshot& map = anew == read_anew_.end() ? *map_ : *anew->second;
  DSG_ASSIGN_OR_RETURN(MeshBlock block, map.ReadMeshBlock(index));
  TransformMesh(map_T_stored_, &block);
  entries_.emplace_front(index, std::make_shared<const MeshBlock>(std::move(block)));
  by_index_[index] = entries_.begin();
  if (entries_.size() > count_max_) {
    by_index_.erase(entries_.back().first);
    entries_.pop_back();
  }
  return entries_.front().second;
}

void BlockCache::ReadAnew(BlockIndex index, std::shared_ptr<const Snapshot> map) {
  read_anew_[index] = std::move(map);
  const auto found = by_index_.find(index);
  if (found == by_index_.end()) return;
  entries_.erase(found->second);
  by_index_.erase(found);
}

std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block) {
  if (!block.normals_map.empty()) return block.normals_map;
  std::vector<Eigen::Vector3f> normals(block.positions_map.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : block.faces) {
    const Eigen::Vector3f& at = block.positions_map[a];
    const Eigen::Vector3f normal = (block.positions_map[b] - at).cross(block.positions_map[c] - at);
    for (const uint32_t corner : {a, b, c}) normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : normals) {
    const float length = normal.norm();
    if (length > 0.0f) normal /= length;
  }
  return normals;
}

std::vector<Eigen::Vector3d> SurfaceIndex::PositionsOf(const std::vector<SurfacePoint>& points) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(points.size());
  for (const SurfacePoint& point : points) positions.push_back(point.position);
  return positions;
}

SurfaceIndex::SurfaceIndex(std::vector<SurfacePoint> points, const MeshJoinOptions& options)
    : points_(std::move(points)),
      options_(options),
      cosine_min_(std::cos(options.normal_angle_max_rad)),
      grid_(PositionsOf(points_), 0.1) {}

int SurfaceIndex::Find(const SurfacePoint& point) const {
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  grid_.ForEachNear(point.position, options_.near_m + options_.along_m, [&](int i) {
    const SurfacePoint& known = points_[static_cast<size_t>(i)];
    const Eigen::Vector3d offset = point.position - known.position;
    const double squared = offset.squaredNorm();
    if (squared > least || (squared == least && i > nearest)) return;
    const bool has_normals = !known.normal.isZero() && !point.normal.isZero();
    if (has_normals && known.normal.dot(point.normal) < cosine_min_) return;
    const double across = std::abs(offset.dot(known.normal));
    const double along = std::sqrt(std::max(0.0, squared - across * across));
    if (across > options_.near_m || along > options_.along_m) return;
    least = squared;
    nearest = i;
  });
  return nearest;
}

}  // namespace dsg::merge
