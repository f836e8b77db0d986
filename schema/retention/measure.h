// SPDX-License-Identifier: Apache-2.0
// What exactly a selection removes from a map, and how much that is.
#pragma once

#include "absl/status/status.h"
#include "schema/retention/plan.h"
#include "schema/retention/selection.h"

namespace dsg {

/// One selection and its effects.
struct Measured {
  Selection selection;
  Amount amount;
  std::vector<TrackPlan> tracks;
  std::vector<StayKey> stay_removals;
  std::vector<StayEdit> stay_edits;
  MeshPlan mesh;
  /// Number of removed edges per node, each edge counted at its first selected node in the order of
  /// GraphIndex::bottom_up.
  std::vector<int32_t> edge_counts;
  /// Forgotten poses; thinned ones are not counted.
  int64_t forgotten_pose_count = 0;
};

/// Fills all fields except `selection`.
absl::Status Measure(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                     std::vector<Measured>* all);

/// Restores the open end of a stay that readers see clipped to the end of the track.
Stay WithOpenEnd(Stay stay, const TrackInfo& track);

}  // namespace dsg
