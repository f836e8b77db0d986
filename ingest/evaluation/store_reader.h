// SPDX-License-Identifier: Apache-2.0
// From a map in a store to the plain estimate that is scored.
// Refuses to open the ground truth, so that nothing of it can leak into an estimate.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/evaluation/estimate.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {

/// Told now and then what is being done and how far it is, 0 to 1. May be empty.
using ProgressFunction = std::function<void(const std::string& what, double fraction)>;

/// Reads a map at a revision; 0 = the newest.
///
/// The robot's causal trajectory is told by the revisions: a pose counts as first committed when a
/// revision ends the track later than the one before did. Poses put in by a later correction were
/// never said in time and are left out of it.
///
/// Errors: what the store returns.
/// Cost:   every row of the map once, and one look-up of the robot's track per revision.
absl::StatusOr<Estimate> ReadEstimate(MapReader& map, Revision revision,
                                      const ProgressFunction& progress);

}  // namespace dsg::evaluation
