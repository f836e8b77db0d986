// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/mesh_numbering.h"

#include <algorithm>
#include <numeric>

#include "schema/interop/json_peek.h"

namespace dsg {

MeshNumbering::MeshNumbering(const SparkGraph& graph, double block_size_m) {
  if (!graph.mesh.has_value()) return;
  const auto& points = graph.mesh->positions_map;
  std::vector<BlockIndex> blocks;
  blocks.reserve(points.size());
  for (const Eigen::Vector3f& point : points) blocks.push_back(BlockOf(point, block_size_m));
  // JoinBlocks writes block by block, within one in the order of the file.
  std::vector<uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return blocks[a] < blocks[b]; });
  number_of_.resize(order.size());
  for (uint32_t i = 0; i < order.size(); ++i) number_of_[order[i]] = i;
  is_needed_ = !std::is_sorted(order.begin(), order.end());
}

SparkNode MeshNumbering::Renumber(const SparkNode& node) const {
  SparkNode renumbered = node;
  for (const char* name :
       {"mesh_connections", "pcl_mesh_connections", "pcl_boundary_connections"}) {
    if (!Peek(node.fields, name).is_array()) continue;
    nlohmann::json& list = renumbered.fields[name];
    const bool is_ours = std::all_of(list.begin(), list.end(), [this](const auto& number) {
      return number.is_number_unsigned() && PeekUnsigned(number) < number_of_.size();
    });
    if (!is_ours) continue;
    for (nlohmann::json& number : list) number = number_of_[number.get<size_t>()];
  }
  return renumbered;
}

}  // namespace dsg
