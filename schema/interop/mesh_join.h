// SPDX-License-Identifier: Apache-2.0
// The blocks of a mesh as one piece: what SplitIntoBlocks did, undone.
// Refuses to weld what only lies close together.
#pragma once

#include <vector>

#include "schema/model/mesh.h"

namespace dsg {

/// Vertices of all blocks in order. A vertex that lies in another block's cell and is there too,
/// equal in all channels, is written once: it is the copy that a face across the border needed.
/// Channels that not all vertices have are dropped; normals and instances too, as no format asks.
MeshBlock JoinBlocks(const std::vector<MeshBlock>& blocks, double block_size_m);

}  // namespace dsg
