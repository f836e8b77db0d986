// SPDX-License-Identifier: Apache-2.0
// What has to be written so that a map is again what it was: keys only, cut into batches that are
// valid deltas in their order. Reads only what some revision between touched, and the shapes,
// factors and stays of agents, which no list of touched keys names.
#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/model/graph_delta.h"
#include "schema/retention/amount.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

// The steps. What is written is read from the wanted snapshot when its turn comes.
struct RemoveEdge {
  EdgeKey key;
};
struct RemoveStay {
  StayKey key;
};
struct RetireNode {
  NodeId id;
};
struct WriteLabel {
  SemanticLabel label;
};
struct WriteNode {
  NodeId id;
};
struct WriteEdge {
  EdgeKey key;
};
/// Of the wanted snapshot within the span; what is there goes.
struct CorrectTrack {
  TrackSpan span;
};
struct ReplaceFactors {
  NodeId agent;
};
struct ReplaceShapes {
  TrackSpan span;
};
struct WriteStay {
  Stay stay;
};
struct RemoveBlock {
  BlockIndex index;
};
struct WriteBlock {
  BlockIndex index;
};
using RevertStep =
    std::variant<RemoveEdge, RemoveStay, RetireNode, WriteLabel, WriteNode, WriteEdge, CorrectTrack,
                 ReplaceFactors, ReplaceShapes, WriteStay, RemoveBlock, WriteBlock>;

struct RevertPlan {
  /// Each a delta.
  std::vector<std::vector<RevertStep>> batches;
  /// Rows that the wanted snapshot has and the present one has not, or otherwise.
  Amount written;
  /// Rows that the present snapshot has and the wanted one has not.
  Amount removed;
};

/// Both snapshots must be of `map`, `wanted` the older one.
/// Errors: as Snapshot and MapReader::TouchedBetween.
absl::StatusOr<RevertPlan> PlanRevert(MapReader* map, const Snapshot& present,
                                      const Snapshot& wanted, const StopCheck& stop);

/// The delta of a batch, without its header. `present` is the head that it will be applied to.
absl::StatusOr<GraphDelta> MakeRevertDelta(const std::vector<RevertStep>& batch,
                                           const Snapshot& present, const Snapshot& wanted,
                                           const StopCheck& stop);

}  // namespace dsg::query
