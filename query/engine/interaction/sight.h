// SPDX-License-Identifier: Apache-2.0
// Whether a wall stands between two points: by the mesh where there is one, else by the boxes of
// walls. Furniture, glass and people are no walls.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Threads: one caller at a time; it keeps the blocks that it has read.
class Sight {
 public:
  /// Errors: FIELD_INVALID naming line_of_sight where the map has neither mesh nor walls; what
  /// `stop` returned.
  static absl::StatusOr<std::unique_ptr<Sight>> Make(const Snapshot& snapshot,
                                                     const StopCheck& stop);
  virtual ~Sight() = default;

  /// `at_ns`: walls have a time, the mesh has none. The last 0.2 m at both ends are not looked at,
  /// since the points are in the middle of bodies, and bodies lean on walls.
  virtual absl::StatusOr<bool> IsClear(const Eigen::Vector3d& from_map,
                                       const Eigen::Vector3d& to_map, TimeNs at_ns) = 0;
};

}  // namespace dsg::query
