// SPDX-License-Identifier: Apache-2.0
// What the mesh of a map shows of a box: matter in it, and what it would stand on.
// Refuses boxes of a whole storey: it says that there is matter in those.
#pragma once

#include "absl/status/statusor.h"
#include "schema/merge/block_cache.h"
#include "schema/merge/session_change.h"

namespace dsg::merge {

/// Threads: one caller at a time.
class MeshProbe {
 public:
  /// `map_T_other` carries the mesh into the frame of the boxes.
  MeshProbe(const Snapshot& other, const Pose3d& map_T_other);

  absl::StatusOr<BoxSurface> Look(const Pose3d& map_T_box, const Box3d& box, double slack_m);

 private:
  Pose3d other_T_map_;
  double block_size_m_;
  BlockCache blocks_;
};

}  // namespace dsg::merge
