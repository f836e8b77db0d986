// SPDX-License-Identifier: Apache-2.0
// Finds the lattice of a mesh that was made by marching cubes: every vertex lies on an edge between
// two neighbouring points of a cubic lattice, every face in one cell of it.
// It makes no meshes and knows no table of cases; it only recognises.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg {

using LatticePoint = std::array<int32_t, 3>;

/// Larger blocks, and those that fill more of the lattice, are not recognised: bounds on what
/// decoding a block may allocate.
inline constexpr int64_t kLatticeVerticesMax = int64_t{1} << 20;
inline constexpr int64_t kLatticeFacesMax = int64_t{1} << 20;
inline constexpr int64_t kLatticePointsMax = int64_t{1} << 22;
inline constexpr size_t kFacesPerCellMax = 8;
inline constexpr int kEdgesPerCell = 12;
inline constexpr int64_t kPitchMax = int64_t{1} << 20;

/// On the edge from `point` to the next one along `axis`.
struct LatticeVertex {
  LatticePoint point{};
  int axis = 0;
  /// In steps (mesh_grid.h); more than 0, less than the pitch.
  int32_t fraction = 0;
};

struct LatticeCell {
  LatticePoint cell{};
  /// Three edges a face, one byte each; see EdgePoint.
  std::string edges;
};

struct MeshLattice {
  /// Distance of two points, and coordinate of point 0, in steps. 0 <= offset < pitch.
  int64_t pitch = 0;
  int64_t offset = 0;
  /// Of the lowest cell; points and cells are counted from it.
  std::array<int64_t, 3> low{};
  /// In cells.
  LatticePoint size{};
  /// In the order of the block.
  std::vector<LatticeVertex> vertices;
  /// Ascending by z, y, x.
  std::vector<LatticeCell> cells;
};

/// Edge `axis * 4 + du + 2 * dv` of a cell begins at `du` steps along the next axis and `dv` along
/// the one after it, in cyclic order.
LatticePoint EdgePoint(const LatticePoint& cell, int edge);

/// nullopt unless the lattice gives back the block bit by bit, in the same order of vertices and
/// faces.
std::optional<MeshLattice> FindLattice(const MeshBlock& block);

}  // namespace dsg
