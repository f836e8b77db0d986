// SPDX-License-Identifier: Apache-2.0
// Whether all that a merge would write may be written, asked before any of it is.
// Refuses to mend what does not fit.
#pragma once

#include "absl/status/status.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"
#include "schema/merge/merge.h"

namespace dsg::merge {

/// Whether what the other map holds stays within coordinates and times of this one. `theirs` is
/// adopted already (see merge_graph.h).
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the transform, what it carries away and the bound;
/// OUT_OF_RANGE/TIME_OUTSIDE_MAP naming an agent; what `stop` returned.
/// Cost: reads all poses and mesh blocks of the other map.
absl::Status CheckReach(const MapSpec& into, const Snapshot& other, const MapContent& theirs,
                        const Pose3d& map_T_other, const StopCheck& stop);

/// Whether the graph of a plan is a delta that map `mine` would take, whole. Fills in its header.
/// Errors: as CheckDelta.
absl::Status CheckGraph(const MapContent& mine, MergePlan* plan);

}  // namespace dsg::merge
