// SPDX-License-Identifier: Apache-2.0
// A part of a mesh block: some of its vertices and faces, with all channels.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg {

/// The middle of a face, map frame. Requires: the face names vertices of the block.
Eigen::Vector3d CenterOf(const MeshBlock& block, const std::array<uint32_t, 3>& face);

/// The vertices that `is_kept` marks, in their order, and `faces`, which name vertices of `block`.
/// Requires: one mark a vertex; the corners of `faces` are marked; channels are empty or whole.
MeshBlock PartOf(const MeshBlock& block, const std::vector<bool>& is_kept,
                 std::vector<std::array<uint32_t, 3>> faces);

}  // namespace dsg
