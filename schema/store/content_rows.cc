// SPDX-License-Identifier: Apache-2.0
#include "schema/store/content_rows.h"

namespace dsg {

std::string RowIdentity(char letter, std::span<const int64_t> columns, std::string_view payload) {
  std::string identity(1, letter);
  identity.append(reinterpret_cast<const char*>(columns.data()), columns.size_bytes());
  identity.append(payload);
  return identity;
}

RowSums& RowSums::operator+=(const RowSums& other) {
  content += other.content;
  node_count += other.node_count;
  edge_count += other.edge_count;
  agent_count += other.agent_count;
  pose_count += other.pose_count;
  stay_count += other.stay_count;
  mesh_block_count += other.mesh_block_count;
  for (const auto& [layer, count] : other.layer_counts) layer_counts[layer] += count;
  return *this;
}

RowSums& RowSums::operator-=(const RowSums& other) {
  content -= other.content;
  node_count -= other.node_count;
  edge_count -= other.edge_count;
  agent_count -= other.agent_count;
  pose_count -= other.pose_count;
  stay_count -= other.stay_count;
  mesh_block_count -= other.mesh_block_count;
  for (const auto& [layer, count] : other.layer_counts) layer_counts[layer] -= count;
  return *this;
}

}  // namespace dsg
