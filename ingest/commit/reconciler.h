// SPDX-License-Identifier: Apache-2.0
// Compares a delta with what the map held when the log began, and keeps only what is news.
// Refuses a log that contradicts stored poses: an overlap must say the same.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "ingest/commit/map_view.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Every decision rests on the map before the log began, or comes out the same for a map that
/// holds part of the log, so an interrupted log resumes to the same end.
///
/// Threads: one caller at a time.
class Reconciler {
 public:
  /// Requires: `map` outlives the reconciler.
  explicit Reconciler(const MapView& map) : map_(map) {}

  /// Takes note of a delta that this session has committed in an earlier run.
  void ObserveCommitted(const GraphDelta& delta);

  /// What the map knew of the node of an agent when the log began counts no more.
  void ForgetNode(NodeId agent);

  /// Counts the new poses of a delta that is about to be reconciled, in parts.
  absl::Status CountNews(const std::vector<GraphDelta>& parts);

  /// Removes from `delta` what the map holds already. Deltas must come in order, counted before.
  ///
  /// Errors: ALREADY_EXISTS/TRACK_CONFLICT when a pose at or before the end of the stored track
  /// differs from what is stored, naming agent, time and both positions.
  absl::Status Reconcile(GraphDelta* delta);

  /// Poses found stored already.
  int64_t skipped_pose_count() const { return skipped_pose_count_; }

 private:
  struct Known {
    /// As stored when the log began.
    std::optional<Node> node;
    std::optional<TrackInfo> track;
    /// The stay that holds the end of the stored track, cut there even if it is stored open.
    std::optional<Stay> last_stay;
    /// This session has stored the last stay open.
    bool is_last_open = false;
    /// The end of the last stay is this session's business: stored already, or sure to come.
    bool is_last_settled = false;
    /// An open stay that is worth a row only once there are new poses.
    std::optional<Stay> held;
    int64_t new_pose_count = 0;
  };

  absl::StatusOr<Known*> Find(NodeId agent);
  absl::Status ReconcileNodes(GraphDelta* delta);
  absl::StatusOr<bool> MergeAgent(Node* node);
  absl::Status ReconcileEdges(GraphDelta* delta);
  absl::Status ReconcileAppends(GraphDelta* delta);
  absl::Status CompareStored(const TrackInfo& track, const std::vector<TimedPose>& log) const;
  absl::StatusOr<TimeNs> KeptFrom(NodeId agent) const;
  absl::Status ReconcileStays(GraphDelta* delta);
  absl::StatusOr<bool> IsInAnotherRoom(const Stay& stay, const Known& known) const;
  void ReconcileStay(const Stay& stay, Known* known, std::vector<Stay>* news);
  void SettleLastStay(Known* known, std::vector<Stay>* news);

  const MapView& map_;
  std::unordered_map<NodeId, Known> known_;
  /// Stays that an earlier run of this session left as its newest word on an agent.
  std::unordered_map<NodeId, Stay> told_;
  int64_t skipped_pose_count_ = 0;
};

}  // namespace dsg::ingest
