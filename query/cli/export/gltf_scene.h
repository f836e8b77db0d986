// SPDX-License-Identifier: Apache-2.0
// A map as a glTF scene that any viewer of the format shows.
// Refuses to turn the data: all of it keeps the map's frame, and one node at the top turns z up
// into the y up of the format.
#pragma once

#include "query/cli/export/gltf_document.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/mesh_look.h"

namespace dsg::cli {

/// Vertices of one primitive of the mesh, at most, unless one block has more.
inline constexpr size_t kPrimitiveVertexCountMax = size_t{1} << 22;

/// Below the top: "mesh"; one group a layer with a child a node (rooms as wire prisms or boxes,
/// places as small balls, objects and others as wire boxes, agents as balls where they were last
/// and their tracks); "edges" with one child a relation. Children carry the node's name, or its id
/// where it has none, and id, kind, class in their extras.
GltfDocument MakeGltf(const MapContent& content, MeshColor color,
                      size_t primitive_vertex_count_max = kPrimitiveVertexCountMax);

}  // namespace dsg::cli
