// SPDX-License-Identifier: Apache-2.0
// Where agents stayed, at an instant or ever, as a search asks for it: by agent, and by place or
// room.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// The same stays that ListPresence lists: an open one ends with the last pose of its agent.
///
/// Threads: one caller at a time.
class Stays {
 public:
  /// `snapshot` is of the revision of `view`, and null if nobody stayed anywhere; both, and `stop`,
  /// must outlive this. nullopt = stays of any time.
  Stays(const GraphView& view, const Snapshot* snapshot, std::optional<TimeNs> at_ns,
        const StopCheck& stop)
      : view_(view), snapshot_(snapshot), at_ns_(at_ns), stop_(stop) {}

  /// Places and rooms that an agent stayed in, ascending. Valid as long as this.
  /// Errors: of the store.
  absl::StatusOr<const std::vector<NodeId>*> NodesOf(NodeId agent);

  /// Agents that stayed in a place or room, ascending. Valid as long as this.
  /// Errors: of the store; what `stop` returned. Cost: the first call reads all stays.
  absl::StatusOr<const std::vector<NodeId>*> AgentsIn(NodeId place_or_room);

 private:
  const GraphView& view_;
  const Snapshot* snapshot_;
  std::optional<TimeNs> at_ns_;
  const StopCheck& stop_;
  std::unordered_map<NodeId, std::vector<NodeId>> nodes_of_;
  bool is_read_ = false;
  std::unordered_map<NodeId, std::vector<NodeId>> agents_in_;
  const std::vector<NodeId> none_;
};

}  // namespace dsg::query
