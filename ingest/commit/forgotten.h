// SPDX-License-Identifier: Apache-2.0
// Fits the deltas of a session to a map that has forgotten some of what the session told it.
// Refuses to bring back what was forgotten: an agent comes back with what is observed from then on.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "ingest/commit/map_view.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class Forgotten {
 public:
  /// Requires: `map` outlives this.
  explicit Forgotten(const MapView& map) : map_(map) {}

  /// Takes note of the agents of a delta of this session, whether it is new to the map or not.
  void Observe(const GraphDelta& delta);

  /// Takes note of what an earlier run of this session has told.
  void ObserveCommitted(const GraphDelta& delta);

  /// Leaves out what is known to be forgotten: news without poses of agents that are not there any
  /// more, and all that is older than the return of an agent.
  absl::Status LeaveOut(GraphDelta* delta);

  /// Makes a delta that the map refused fit for it. Agents with poses in it return; what else it
  /// says of nodes that are not there is left out. False when that is not why it was refused.
  bool Mend(const absl::Status& refusal, GraphDelta* delta);

  /// Counts the poses of a delta that the map took.
  void ObserveTaken(const GraphDelta& delta);

  /// Has the agent come back?
  bool HasReturned(NodeId agent) const;

 private:
  struct Agent {
    /// As the log said it last.
    std::optional<Node> node;
    /// What its node refers to, which may have gone with it.
    std::vector<Asset> assets;
    /// The map has taken it in this session.
    bool is_told = false;
    /// Of the poses of an earlier run; kTimeMax = there are none.
    TimeNs first_told_ns = kTimeMax;
    bool is_compared = false;
    /// Unset = nothing of it was forgotten.
    std::optional<TimeNs> back_since_ns;
    /// Since it came back.
    int64_t pose_count = 0;
  };

  absl::Status CompareWithMap(const GraphDelta& delta);
  absl::Status LeaveOutGone(GraphDelta* delta);
  absl::StatusOr<bool> IsExpected(NodeId agent);
  bool MendMissing(const std::vector<NodeId>& missing, GraphDelta* delta);
  bool Return(NodeId agent, GraphDelta* delta);
  void LeaveOutOlder(NodeId agent, TimeNs since_ns, int64_t pose_count, GraphDelta* delta) const;

  const MapView& map_;
  std::map<NodeId, Agent> agents_;
};

}  // namespace dsg::ingest
