// SPDX-License-Identifier: Apache-2.0
// From a map in a store to the plain estimate that is scored.
// Refuses to open the ground truth, so that nothing of it can leak into an estimate.
#pragma once

#include "absl/status/statusor.h"
#include "ingest/evaluation/estimate.h"
#include "ingest/evaluation/robot_tracks.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {

/// Reads a map at a revision; 0 = the newest.
///
/// The robot's trajectories are those of ReadRobotTracks.
///
/// Errors: what the store returns.
/// Cost:   every row of the map once, and one look-up of the robot's track per revision.
absl::StatusOr<Estimate> ReadEstimate(MapReader& map, Revision revision,
                                      const ProgressFunction& progress);

}  // namespace dsg::evaluation
