// SPDX-License-Identifier: Apache-2.0
// Removes a part of space from a mesh block. Triangles are removed whole.
#pragma once

#include <vector>

#include "schema/model/geometry.h"
#include "schema/model/mesh.h"

namespace dsg {

/// A part of the map's space: a box, or what stands on a floor plan.
struct Solid {
  Box3d box_map;
  /// Corners of the floor plan, inside the box; empty = the whole box.
  Polygon2d footprint_map;

  bool Contains(const Eigen::Vector3d& point_map) const;
};

/// The faces with their centre in a solid go, and the vertices that only they used; so do vertices
/// of no face inside. Face and vertex order stay. `is_cut`: something went.
///
/// Requires: the block satisfies CheckDelta.
MeshBlock CutMesh(const MeshBlock& block, const std::vector<Solid>& solids, bool* is_cut);

/// May the block have something in a solid? Vertices of faces may lie outside of the block's cube.
bool MayTouch(const MeshBlock& block, const std::vector<Solid>& solids);

}  // namespace dsg
