// SPDX-License-Identifier: Apache-2.0
#include "schema/model/mesh_part.h"

#include <utility>

namespace dsg {
namespace {

template <typename T>
void Keep(const std::vector<bool>& is_kept, const std::vector<T>& from, std::vector<T>* to) {
  for (size_t i = 0; i < from.size(); ++i) {
    if (is_kept[i]) to->push_back(from[i]);
  }
}

}  // namespace

Eigen::Vector3d CenterOf(const MeshBlock& block, const std::array<uint32_t, 3>& face) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t corner : face) sum += block.positions_map[corner].cast<double>();
  return sum / 3.0;
}

MeshBlock PartOf(const MeshBlock& block, const std::vector<bool>& is_kept,
                 std::vector<std::array<uint32_t, 3>> faces) {
  std::vector<uint32_t> new_index(is_kept.size(), 0);
  uint32_t next = 0;
  for (size_t i = 0; i < is_kept.size(); ++i) {
    new_index[i] = next;
    if (is_kept[i]) ++next;
  }
  for (auto& face : faces) {
    for (uint32_t& corner : face) corner = new_index[corner];
  }
  MeshBlock part;
  part.index = block.index;
  part.faces = std::move(faces);
  Keep(is_kept, block.positions_map, &part.positions_map);
  Keep(is_kept, block.normals_map, &part.normals_map);
  Keep(is_kept, block.colors, &part.colors);
  Keep(is_kept, block.labels, &part.labels);
  Keep(is_kept, block.instance_ids, &part.instance_ids);
  Keep(is_kept, block.first_seen_ns, &part.first_seen_ns);
  Keep(is_kept, block.last_seen_ns, &part.last_seen_ns);
  return part;
}

}  // namespace dsg
