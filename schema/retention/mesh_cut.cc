// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/mesh_cut.h"

#include <algorithm>

namespace dsg {
namespace {

bool IsInside(const Eigen::Vector3d& point_map, const std::vector<Solid>& solids) {
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& solid) { return solid.Contains(point_map); });
}

Eigen::Vector3d CenterOf(const MeshBlock& block, const std::array<uint32_t, 3>& face) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t corner : face) sum += block.positions_map[corner].cast<double>();
  return sum / 3.0;
}

template <typename T>
void Keep(const std::vector<bool>& is_kept, const std::vector<T>& from, std::vector<T>* to) {
  for (size_t i = 0; i < from.size(); ++i) {
    if (is_kept[i]) to->push_back(from[i]);
  }
}

}  // namespace

bool Solid::Contains(const Eigen::Vector3d& point_map) const {
  if (!box_map.contains(point_map)) return false;
  return footprint_map.empty() || PolygonContains(footprint_map, point_map.head<2>());
}

MeshBlock CutMesh(const MeshBlock& block, const std::vector<Solid>& solids, bool* is_cut) {
  const size_t count = block.positions_map.size();
  MeshBlock rest;
  rest.index = block.index;
  std::vector<bool> is_in_face(count, false);
  std::vector<bool> is_kept(count, false);
  for (const auto& face : block.faces) {
    const bool goes = IsInside(CenterOf(block, face), solids);
    if (!goes) rest.faces.push_back(face);
    for (const uint32_t corner : face) {
      is_in_face[corner] = true;
      if (!goes) is_kept[corner] = true;
    }
  }
  std::vector<uint32_t> new_index(count, 0);
  uint32_t next = 0;
  for (size_t i = 0; i < count; ++i) {
    if (!is_in_face[i]) is_kept[i] = !IsInside(block.positions_map[i].cast<double>(), solids);
    new_index[i] = next;
    if (is_kept[i]) ++next;
  }
  *is_cut = next != count || rest.faces.size() != block.faces.size();
  for (auto& face : rest.faces) {
    for (uint32_t& corner : face) corner = new_index[corner];
  }
  Keep(is_kept, block.positions_map, &rest.positions_map);
  Keep(is_kept, block.normals_map, &rest.normals_map);
  Keep(is_kept, block.colors, &rest.colors);
  Keep(is_kept, block.labels, &rest.labels);
  Keep(is_kept, block.instance_ids, &rest.instance_ids);
  Keep(is_kept, block.first_seen_ns, &rest.first_seen_ns);
  Keep(is_kept, block.last_seen_ns, &rest.last_seen_ns);
  return rest;
}

bool MayTouch(const MeshBlock& block, const std::vector<Solid>& solids) {
  Box3d bounds;
  for (const auto& position : block.positions_map) bounds.extend(position.cast<double>());
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& solid) { return solid.box_map.intersects(bounds); });
}

}  // namespace dsg
