// SPDX-License-Identifier: Apache-2.0
// The short form of a mesh block: marching cubes on the grid of mesh_grid.h, about 2 bytes a vertex
// for shape and faces. Nothing is rounded here: a block that this form cannot give back bit by bit
// is refused, and stored in the general form (proto_convert.h, EncodeMeshBlock).
//
// Layout, docs/storage_format.md: a head of varints, then bits of a range coder, cell by cell of
// the lattice. Encoder and decoder are one walk over the cells.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "schema/model/mesh.h"

namespace dsg {

/// First byte of the short form. The general form begins with that of a zstd frame, 0x28.
inline constexpr char kLatticeMeshVersion = 1;

/// nullopt unless DecodeLatticeMesh gives the same block: see FindLattice; also, normals are on the
/// grid of directions, colours have no bits above 0xffffff, and there are at most 65,536 different
/// pairs of label and instance, and of times.
std::optional<std::string> EncodeLatticeMesh(const MeshBlock& block);

bool IsLatticeMesh(std::string_view bytes);

/// False if the bytes are no short form. Allocates at most what kLatticeVerticesMax and its
/// neighbours allow, whatever the bytes. Verify the checksum first: this finds bad structure, not
/// bad numbers.
bool DecodeLatticeMesh(std::string_view bytes, MeshBlock* block);

}  // namespace dsg
