// SPDX-License-Identifier: Apache-2.0
// Which triangles cut a cube whose corners lie on either side of a surface.
// Refuses to know distances: only which corners are inside.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace dsg::ingest {

/// Corner c of the unit cube is at (c & 1, c >> 1 & 1, c >> 2 & 1).
struct CubeEdge {
  /// `low` < `high`, and they differ on `axis` alone.
  int low = 0;
  int high = 0;
  int axis = 0;
};

/// Triangles for each of the 256 sets of inside corners, derived from the faces of the cube: on a
/// face the outline runs around each group of outside corners, so that cubes that share a face
/// draw the same lines on it and diagonal inside corners stay joined. Outlines are closed to loops
/// and cut into triangles without a diagonal on a face of the cube.
/// Source: the idea of Lorensen and Cline, 1987; tables of our own.
class CubeTable {
 public:
  static const CubeTable& Get();

  const std::array<CubeEdge, 12>& edges() const { return edges_; }
  /// `inside`: bit c = corner c is inside. Numbers of edges; counter-clockwise seen from outside.
  const std::vector<std::array<uint8_t, 3>>& Triangles(int inside) const {
    return triangles_[inside];
  }
  /// Bit e = edge e joins an inside corner with an outside one.
  uint16_t CrossedEdges(int inside) const { return crossed_[inside]; }

 private:
  CubeTable();

  std::array<CubeEdge, 12> edges_;
  std::array<std::vector<std::array<uint8_t, 3>>, 256> triangles_;
  std::array<uint16_t, 256> crossed_{};
};

}  // namespace dsg::ingest
