// SPDX-License-Identifier: Apache-2.0
// Where is known to be free: the clearances of places, taken together.
// Refuses to guess: what no clearance covers counts as a wall.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

namespace dsg::query {

struct WalkGraph;

/// Distances are horizontal, within a storey.
///
/// Threads: not changed after construction. Cost: to build, some dozen cells a place; to ask, the
/// places around the point.
class FreeSpace {
 public:
  /// Copies what it needs.
  explicit FreeSpace(const WalkGraph& graph);

  /// A circle of this radius around the point is free; less than 0 where nothing is known.
  double RadiusM(const Eigen::Vector3d& point_map) const;
  /// Whether a straight line is free, and keeps `margin_m` less 5 cm from what is not.
  /// Requires: a margin above 5 cm.
  bool IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
               double margin_m) const;

  size_t memory_bytes() const {
    return balls_.capacity() * sizeof(Ball) + cells_.capacity() * sizeof(cells_[0]);
  }

 private:
  struct Ball {
    Eigen::Vector3d centre_map;
    double radius_m = 0.0;
  };
  using Cell = std::pair<int32_t, int32_t>;

  std::vector<Ball> balls_;
  // Ascending by cell, then ball.
  std::vector<std::pair<Cell, int>> cells_;
};

}  // namespace dsg::query
