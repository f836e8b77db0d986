// SPDX-License-Identifier: Apache-2.0
// Answers GetMesh, a few blocks a message, ListMeshBlocks, and GetAsset. A block that outgrows a
// message is cut into pieces.
#pragma once

#include <vector>

#include "schema/model/mesh.h"

namespace dsg::query {

/// Cuts a block into pieces of at most `vertex_count_max` vertices, each with the faces that it
/// holds. Together they have every face once and every vertex at least once, with all channels; a
/// block that is small enough stays as it is.
/// Requires: vertex_count_max is at least 3.
std::vector<MeshBlock> CutBlock(MeshBlock block, size_t vertex_count_max);

}  // namespace dsg::query
