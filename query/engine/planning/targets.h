// SPDX-License-Identifier: Apache-2.0
// Where nodes are as ends of a path, and which places they block. Refuses to place agents where
// nobody has seen them.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/attach.h"
#include "query/engine/planning/limits.h"
#include "query/view/graph_view.h"
#include "query/view/place_graph.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// What a question knows of the map.
struct PathWorld {
  const GraphView& view;
  const Snapshot& snapshot;
  const PlaceGraph& places;
  /// World time of agents; unset: at the ends of their tracks.
  std::optional<TimeNs> at_ns;
  /// Ends long walks down the hierarchy.
  const StopCheck& stop;
};

/// A place is itself; an agent is where it was, or near there if it is in the way; a node above
/// places is all of them; anything else is its box. Errors: OUT_OF_RANGE/TIME_OUTSIDE_TRACK for an
/// agent that was not seen then; what the world's `stop` returned.
absl::StatusOr<PathTarget> TargetOf(const PathWorld& world, const ViewNode& node);

bool IsAgent(const GraphView& view, const ViewNode& node);

/// Marks the place, or all places below the node. False if the node is neither a place nor of a
/// layer above places. Errors: what the world's `stop` returned.
absl::StatusOr<bool> Block(const PathWorld& world, const ViewNode& node,
                           std::vector<uint8_t>* blocked);

}  // namespace dsg::query
