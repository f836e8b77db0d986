// SPDX-License-Identifier: Apache-2.0
#include "schema/model/mesh.h"

#include <cmath>
#include <map>

namespace dsg {
namespace {

struct BlockBuilder {
  MeshBlock block;
  std::map<uint32_t, uint32_t> local_of_global;
};

template <typename T>
void CopyChannel(const std::vector<T>& from, uint32_t at, std::vector<T>* to) {
  if (!from.empty()) to->push_back(from[at]);
}

uint32_t LocalVertex(const MeshBlock& whole, uint32_t global, BlockBuilder* builder) {
  MeshBlock& block = builder->block;
  const auto [it, added] = builder->local_of_global.try_emplace(
      global, static_cast<uint32_t>(block.positions_map.size()));
  if (added) {
    block.positions_map.push_back(whole.positions_map[global]);
    CopyChannel(whole.normals_map, global, &block.normals_map);
    CopyChannel(whole.colors, global, &block.colors);
    CopyChannel(whole.labels, global, &block.labels);
    CopyChannel(whole.instance_ids, global, &block.instance_ids);
    CopyChannel(whole.first_seen_ns, global, &block.first_seen_ns);
    CopyChannel(whole.last_seen_ns, global, &block.last_seen_ns);
  }
  return it->second;
}

}  // namespace

BlockIndex BlockOf(const Eigen::Vector3f& point_map, double block_size_m) {
  const Eigen::Vector3d cell = point_map.cast<double>() / block_size_m;
  return {static_cast<int32_t>(std::floor(cell.x())), static_cast<int32_t>(std::floor(cell.y())),
          static_cast<int32_t>(std::floor(cell.z()))};
}

std::vector<MeshBlock> SplitIntoBlocks(const MeshBlock& whole, double block_size_m) {
  std::map<BlockIndex, BlockBuilder> builders;
  // Every vertex goes to its own block first, so that vertices without faces are kept.
  for (uint32_t v = 0; v < whole.positions_map.size(); ++v) {
    LocalVertex(whole, v, &builders[BlockOf(whole.positions_map[v], block_size_m)]);
  }
  for (const auto& face : whole.faces) {
    BlockBuilder& builder = builders[BlockOf(whole.positions_map[face[0]], block_size_m)];
    builder.block.faces.push_back({LocalVertex(whole, face[0], &builder),
                                   LocalVertex(whole, face[1], &builder),
                                   LocalVertex(whole, face[2], &builder)});
  }
  std::vector<MeshBlock> blocks;
  blocks.reserve(builders.size());
  for (auto& [index, builder] : builders) {
    builder.block.index = index;
    blocks.push_back(std::move(builder.block));
  }
  return blocks;
}

}  // namespace dsg
