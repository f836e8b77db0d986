// SPDX-License-Identifier: Apache-2.0
// A mesh with fewer triangles, for pictures from afar: vertices that share a cube of a grid become
// one. Source: Rossignac and Borrel, "Multi-resolution 3D approximations for rendering complex
// scenes", 1993 (vertex clustering).
#pragma once

#include "schema/model/mesh.h"

namespace dsg::query {

/// The block with one vertex for each cube of edge length `cell_m` that has any: the mean of their
/// positions, normals and colours, the first one's label and instance, the earliest and latest of
/// their times. Faces that lose an edge are left out, and so are those that are there already.
///
/// Cubes begin at the origin of the map. Blocks are coarsened one by one, so that seams between
/// them open by at most a cell.
///
/// Requires: cell_m > 0.
MeshBlock CoarsenBlock(const MeshBlock& block, double cell_m);

}  // namespace dsg::query
