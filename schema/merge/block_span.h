// SPDX-License-Identifier: Apache-2.0
// Which blocks of a mesh a box touches.
// Refuses to know what is in them.
#pragma once

#include <vector>

#include "schema/model/mesh.h"

namespace dsg::merge {

Box3d BoxOf(BlockIndex index, double block_size_m);

/// All blocks that touch a box. Order: ascending. Cost: that of the volume of the box.
std::vector<BlockIndex> BlocksIn(const Box3d& box, double block_size_m);

}  // namespace dsg::merge
