// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/mesh_cut.h"

#include <algorithm>
#include <utility>

#include "schema/model/mesh_part.h"

namespace dsg {
namespace {

bool IsInside(const Eigen::Vector3d& point_map, const std::vector<Solid>& solids) {
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& solid) { return solid.Contains(point_map); });
}

}  // namespace

bool Solid::Contains(const Eigen::Vector3d& point_map) const {
  if (!box_map.contains(point_map)) return false;
  return footprint_map.empty() || PolygonContains(footprint_map, point_map.head<2>());
}

MeshBlock CutMesh(const MeshBlock& block, const std::vector<Solid>& solids, bool* is_cut) {
  const size_t count = block.positions_map.size();
  std::vector<std::array<uint32_t, 3>> faces;
  std::vector<bool> is_in_face(count, false);
  std::vector<bool> is_kept(count, false);
  for (const auto& face : block.faces) {
    const bool goes = IsInside(CenterOf(block, face), solids);
    if (!goes) faces.push_back(face);
    for (const uint32_t corner : face) {
      is_in_face[corner] = true;
      if (!goes) is_kept[corner] = true;
    }
  }
  for (size_t i = 0; i < count; ++i) {
    if (!is_in_face[i]) is_kept[i] = !IsInside(block.positions_map[i].cast<double>(), solids);
  }
  MeshBlock rest = PartOf(block, is_kept, std::move(faces));
  *is_cut = rest.positions_map.size() != count || rest.faces.size() != block.faces.size();
  return rest;
}

bool MayTouch(const MeshBlock& block, const std::vector<Solid>& solids) {
  Box3d bounds;
  for (const auto& position : block.positions_map) bounds.extend(position.cast<double>());
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& solid) { return solid.box_map.intersects(bounds); });
}

}  // namespace dsg
