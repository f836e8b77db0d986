// SPDX-License-Identifier: Apache-2.0
// A block of a mesh as packed columns.
#pragma once

#include "schema/model/mesh.h"

namespace dsg::v1 {
class MeshColumns;
}  // namespace dsg::v1

namespace dsg::query {

/// Fills `out` with what the block has; see MeshColumns in proto/dsg/v1/scene.proto.
///
/// is_coarse: positions of 16 bits within the bounds of the block, and normals of 8. The step is
/// the longest edge of the bounds / 65,535: 15 micrometres for a block of a metre.
///
/// Requires: at most 65,536 vertices.
void FillMeshColumns(const MeshBlock& block, bool is_coarse, v1::MeshColumns* out);

}  // namespace dsg::query
