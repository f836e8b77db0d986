// SPDX-License-Identifier: Apache-2.0
// The bits of a mesh on a lattice: which cells have faces, between which of their edges, and what
// each vertex is like. Encoding and decoding are the same walk, so they foretell the same.
// The head of the block is mesh_codec.cc's.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "schema/codec/mesh_lattice.h"
#include "schema/model/mesh_grid.h"

namespace dsg {

/// What a walk has to know before it begins; each within the limits of mesh_lattice.h.
struct WalkSize {
  uint64_t vertex_count = 0;
  uint64_t face_count = 0;
  LatticePoint cells{};
  int64_t pitch = 0;
  bool has_normals = false;
  bool has_colors = false;
  /// Numbers of VertexCode are below these. At least 1 and at most 65,536.
  uint64_t meaning_count = 0;
  uint64_t times_count = 0;
};

/// What is said of a vertex besides its place.
struct VertexCode {
  NormalCode normal;
  /// 0xRRGGBB.
  uint32_t color = 0;
  /// Numbers in the lists of the head.
  uint32_t meaning = 0;
  uint32_t times = 0;
};

struct WalkedMesh {
  std::vector<LatticeVertex> vertices;
  std::vector<VertexCode> codes;
  std::vector<std::array<uint32_t, 3>> faces;
};

/// Appends to `out`. Requires: `size` is that of the lattice, one code a vertex.
void EncodeWalk(const WalkSize& size, const MeshLattice& lattice,
                const std::vector<VertexCode>& codes, std::string* out);

/// False when the bytes are not what EncodeWalk wrote for `size`, as far as that can be seen.
bool DecodeWalk(const WalkSize& size, std::string_view bytes, WalkedMesh* mesh);

}  // namespace dsg
