// SPDX-License-Identifier: Apache-2.0
// What exactly a selection removes from a map, and how much that is.
#pragma once

#include "absl/status/status.h"
#include "schema/retention/plan.h"
#include "schema/retention/selection.h"

namespace dsg {

/// One selection with what comes of it.
struct Measured {
  Selection selection;
  Amount amount;
  std::vector<TrackPlan> tracks;
  std::vector<StayKey> stay_removals;
  std::vector<StayEdit> stay_edits;
  MeshPlan mesh;
  /// Edges by the first node of the selection at them, in the order of GraphIndex::bottom_up.
  std::vector<int32_t> edge_counts;
  /// Poses that are forgotten, thinned ones not counted.
  int64_t forgotten_pose_count = 0;
};

/// Fills all but `selection` of each.
absl::Status Measure(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                     std::vector<Measured>* all);

/// What was clipped to the end of a track gets its open end back.
Stay WithOpenEnd(Stay stay, const TrackInfo& track);

}  // namespace dsg
