// SPDX-License-Identifier: Apache-2.0
// Cuts a square of ground into corridors, halls and rooms that leave nothing over.
// Refuses to know doors, walls or what a room is for.
#pragma once

#include <optional>
#include <vector>

#include "ingest/simulator/world/free_space.h"
#include "schema/base/random.h"

namespace dsg::simulator {

inline constexpr double kOfficeEdgeM = 65.0;

/// Cells in whole centimetres that tile [0, kOfficeEdgeM]^2.
struct Partition {
  /// Straight ones; those along one axis run through, the others end at them.
  std::vector<Rect> corridors;
  /// 100 to 420 m^2.
  std::vector<Rect> halls;
  /// 12 to 60 m^2.
  std::vector<Rect> rooms;
};

/// A loop of corridors with one or two more across in each direction; the blocks between them and
/// around them are cut in two again and again. Nothing when the draw did not come out; draw again.
std::optional<Partition> DrawPartition(Random* random);

/// A piece of wall between two cells, longer than nothing.
struct SharedWall {
  /// Indices of the cells, a < b.
  int a = 0;
  int b = 0;
  /// Whether the wall runs along x.
  bool runs_along_x = true;
  /// Where it stands on the other axis, and from where to where it runs.
  double line_m = 0.0;
  double from_m = 0.0;
  double to_m = 0.0;

  double length_m() const { return to_m - from_m; }
  Point At(double along_m) const {
    return runs_along_x ? Point(along_m, line_m) : Point(line_m, along_m);
  }
};

/// Order: by a, then b.
std::vector<SharedWall> SharedWallsOf(const std::vector<Rect>& cells);

}  // namespace dsg::simulator
