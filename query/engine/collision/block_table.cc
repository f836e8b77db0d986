// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/block_table.h"

#include <algorithm>
#include <utility>

namespace dsg::query {

std::vector<std::array<uint32_t, 3>> UsableFaces(const MeshBlock& block) {
  std::vector<std::array<uint32_t, 3>> faces;
  faces.reserve(block.faces.size());
  for (const std::array<uint32_t, 3>& face : block.faces) {
    const bool usable = std::all_of(face.begin(), face.end(), [&](uint32_t vertex) {
      return vertex < block.positions_map.size() && block.positions_map[vertex].allFinite();
    });
    if (usable) faces.push_back(face);
  }
  return faces;
}

Eigen::AlignedBox3f BoundsOf(const MeshBlock& block) {
  Eigen::AlignedBox3f bounds;
  for (const std::array<uint32_t, 3>& face : UsableFaces(block)) {
    for (const uint32_t vertex : face) bounds.extend(block.positions_map[vertex]);
  }
  return bounds;
}

BlockTable::BlockTable(std::vector<BlockBounds> blocks) : blocks_(std::move(blocks)) {
  std::vector<Eigen::Vector3f> corners;
  std::vector<std::array<uint32_t, 3>> faces;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Eigen::AlignedBox3f& bounds = blocks_[i].bounds;
    if (bounds.isEmpty()) continue;
    const auto low = static_cast<uint32_t>(corners.size());
    corners.push_back(bounds.min());
    corners.push_back(bounds.max());
    faces.push_back({low, low + 1, low});
    block_of_face_.push_back(i);
  }
  tree_ = TriangleTree(std::move(corners), std::move(faces));
}

bool BlockTable::Contains(BlockIndex block) const {
  return std::ranges::binary_search(blocks_, block, {}, &BlockBounds::block);
}

std::vector<const BlockBounds*> BlockTable::Touching(const Box3d& region) const {
  std::vector<const BlockBounds*> touching;
  const double reach_m = 0.0;
  tree_.ForEachNear(region, &reach_m, [&](int face) {
    const BlockBounds& block = blocks_[block_of_face_[tree_.source_face(face)]];
    if (block.bounds.cast<double>().intersects(region)) touching.push_back(&block);
  });
  // They lie in one array, so that addresses ascend with the blocks.
  std::sort(touching.begin(), touching.end());
  return touching;
}

}  // namespace dsg::query
