// SPDX-License-Identifier: Apache-2.0
// Where is known to be free: the clearances of places, taken together.
// Refuses to guess: what no clearance covers counts as a wall.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "query/prediction/cell_map.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

struct WalkGraph;

/// Distances are horizontal, within a storey.
///
/// Threads: not changed after construction. Cost: to build, some dozen cells a place; to ask, the
/// places around the point.
class FreeSpace {
 public:
  /// Copies what it needs. Errors: what `stop` returned.
  static absl::StatusOr<FreeSpace> Make(const WalkGraph& graph, const StopCheck& stop);

  /// A circle of this radius around the point is free; less than 0 where nothing is known.
  double RadiusM(const Eigen::Vector3d& point_map) const;
  /// Whether a straight line is free, and keeps `margin_m` less 5 cm from what is not.
  /// Requires: a margin above 5 cm.
  bool IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
               double margin_m) const;

  size_t memory_bytes() const { return balls_.capacity() * sizeof(Ball) + cells_.memory_bytes(); }

 private:
  struct Ball {
    Eigen::Vector3d centre_map;
    double radius_m = 0.0;
  };

  FreeSpace();

  // The largest first.
  std::vector<Ball> balls_;
  CellMap cells_;
};

}  // namespace dsg::query
