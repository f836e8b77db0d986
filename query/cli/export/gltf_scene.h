// SPDX-License-Identifier: Apache-2.0
// A map as a glTF scene. The data keep the map's frame (z up); one node at the top rotates them to
// the y up of the format.
#pragma once

#include "query/cli/export/gltf_document.h"
#include "query/cli/export/map_content.h"
#include "schema/picture/look.h"

namespace dsg::cli {

/// Maximum number of vertices per primitive of the mesh, unless one block has more.
inline constexpr size_t kPrimitiveVertexCountMax = size_t{1} << 22;

/// Below the top: "mesh"; one group per layer with one child per node (rooms as wire prisms or
/// boxes, places as small balls, objects and others as wire boxes, agents as balls at their last
/// position and their tracks); "edges" with one child per relation. Children carry the node's name,
/// or its id without one, and id, kind, class in their extras.
///
/// Agents with bodies have them as further children. One body stands; several walk (gltf_bodies.h).
GltfDocument MakeGltf(const MapContent& content, MeshColor color,
                      size_t primitive_vertex_count_max = kPrimitiveVertexCountMax);

}  // namespace dsg::cli
