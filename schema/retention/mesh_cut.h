// SPDX-License-Identifier: Apache-2.0
// Removes a part of space from a mesh block. Triangles are removed whole.
#pragma once

#include <vector>

#include "schema/model/geometry.h"
#include "schema/model/mesh.h"

namespace dsg {

/// A part of the space of a map: a box, or a prism over a floor plan.
struct Solid {
  Box3d box_map;
  /// Corners of the floor plan, inside the box; empty = the whole box.
  Polygon2d footprint_map;

  bool Contains(const Eigen::Vector3d& point_map) const;
};

/// Removes faces with their centre in a solid, vertices that only such faces use, and vertices
/// without faces in a solid. Keeps the order of faces and vertices. `is_cut`: something was
/// removed.
///
/// Requires: the block satisfies CheckDelta.
MeshBlock CutMesh(const MeshBlock& block, const std::vector<Solid>& solids, bool* is_cut);

/// Whether the block may have something in a solid. Vertices of faces may lie outside the block's
/// cube.
bool MayTouch(const MeshBlock& block, const std::vector<Solid>& solids);

}  // namespace dsg
