// SPDX-License-Identifier: Apache-2.0
// Copies what an agent of the other map did into this map, one delta at a time: poses, corrections,
// stays, factors, body shapes. Skips what an earlier merge has copied.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "schema/merge/merge.h"

namespace dsg::merge {

/// Threads: one caller at a time. The arguments must outlive this.
class AgentCopy {
 public:
  /// The agent `theirs` of the other map is `mine` here; the node need not exist yet.
  AgentCopy(const Snapshot& into, const Snapshot& other, const MergePlan& plan, NodeId theirs,
            NodeId mine);

  /// The next delta, of at most plan.batch_row_count rows; nullopt at the end.
  /// Order: poses that the other map has corrected since an earlier merge and nobody has changed
  /// here; new poses; stays and factors; shapes.
  absl::StatusOr<std::optional<GraphDelta>> Next(const StopCheck& stop);

  /// Assets that the last delta refers to.
  std::vector<Sha256> TakeTopologies();

 private:
  enum class Stage { kBegin, kCorrections, kPoses, kStays, kShapes, kEnd };

  absl::Status Begin(const StopCheck& stop);
  absl::Status LookAtEnd(const TrackInfo& track, const StopCheck& stop);
  absl::Status ReadCorrections(const StopCheck& stop, GraphDelta* delta);
  absl::Status ReadPoses(const StopCheck& stop, GraphDelta* delta);
  /// Poses of the other map in the frame of this one, from `from_ns` on.
  absl::StatusOr<std::vector<TimedPose>> Carried(TimeNs from_ns, TimeNs to_ns,
                                                 const StopCheck& stop) const;
  /// What each earlier merge may have written for that span.
  absl::StatusOr<std::vector<std::vector<TimedPose>>> CarriedBefore(TimeNs from_ns, TimeNs to_ns,
                                                                    const StopCheck& stop) const;
  /// Whether an earlier merge wrote this stay and nobody has changed it.
  absl::StatusOr<bool> IsAsWritten(const Stay& known) const;
  absl::Status ReadStays(GraphDelta* delta);
  absl::Status ReadFactors(GraphDelta* delta) const;
  absl::Status ReadShapes(const StopCheck& stop, GraphDelta* delta);
  /// The id here of a node of the other map; empty if there is none.
  NodeId Mapped(NodeId theirs_id) const;

  const Snapshot& into_;
  const Snapshot& other_;
  const MergePlan& plan_;
  NodeId theirs_;
  NodeId mine_;
  Stage stage_ = Stage::kBegin;
  bool is_known_ = false;
  /// The other map at the revisions from which this agent was copied; null if it was not copied or
  /// cannot have been corrected since.
  const std::vector<std::shared_ptr<const Snapshot>>* bases_ = nullptr;
  /// Others have extended the track here.
  bool has_own_end_ = false;
  TimeNs compared_to_ns_ = kTimeMin;
  TimeNs next_pose_ns_ = kTimeMin;
  TimeNs next_shape_ns_ = kTimeMin;
  std::vector<Sha256> topologies_;
};

}  // namespace dsg::merge
