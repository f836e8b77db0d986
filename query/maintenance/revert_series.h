// SPDX-License-Identifier: Apache-2.0
// Where series of an agent over time (poses, body shapes) differ between two snapshots, as short
// spans. Holds no more than two chunks of a series in memory.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// A span in which two series differ at its ends and perhaps between, and how many each has there.
struct SeriesDifference {
  TrackSpan span;
  int64_t present_count = 0;
  int64_t wanted_count = 0;
};

/// An agent that a snapshot does not know has no series there. Order: ascending, disjoint.
absl::StatusOr<std::vector<SeriesDifference>> FindPoseDifferences(const Snapshot& present,
                                                                  const Snapshot& wanted,
                                                                  NodeId agent,
                                                                  const StopCheck& stop);
absl::StatusOr<std::vector<SeriesDifference>> FindShapeDifferences(const Snapshot& present,
                                                                   const Snapshot& wanted,
                                                                   NodeId agent,
                                                                   const StopCheck& stop);

/// A unit quaternion that the quantising codec stores as the numbers from which it once made
/// `orientation`. What it gives back is of unit length, which those numbers are not quite, so that
/// storing it again would move it by a step.
Eigen::Quaterniond StoredAsBefore(const Eigen::Quaterniond& orientation);

/// The body shapes of a span with their topologies, as appends.
absl::StatusOr<std::vector<ShapeAppend>> ReadShapeAppends(const Snapshot& snapshot,
                                                          const TrackSpan& span,
                                                          const StopCheck& stop);

}  // namespace dsg::query
