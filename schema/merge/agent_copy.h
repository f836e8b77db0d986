// SPDX-License-Identifier: Apache-2.0
// Copies what an agent of the other map did into this map, one delta at a time: poses, corrections,
// stays, factors, body shapes. Skips what an earlier merge has copied.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "schema/merge/merge.h"

namespace dsg::merge {

/// Threads: one caller at a time. All that is given must outlive this.
class AgentCopy {
 public:
  /// `theirs` in the other map is `mine` in this one, which may not be there yet.
  AgentCopy(const Snapshot& into, const Snapshot& other, const MergePlan& plan, NodeId theirs,
            NodeId mine);

  /// Of an agent that an earlier merge copied whole, poses that the other map has corrected since
  /// and nobody has here; then new poses, then stays and factors, then shapes, at most
  /// plan.batch_row_count rows each; nullopt at the end.
  absl::StatusOr<std::optional<GraphDelta>> Next(const StopCheck& stop);

  /// Assets that the last delta refers to.
  std::vector<Sha256> TakeTopologies();

 private:
  enum class Stage { kBegin, kCorrections, kPoses, kStays, kShapes, kEnd };

  absl::Status Begin(const StopCheck& stop);
  absl::Status LookAtEnd(const TrackInfo& track, const StopCheck& stop);
  absl::Status ReadCorrections(const StopCheck& stop, GraphDelta* delta);
  absl::Status ReadPoses(const StopCheck& stop, GraphDelta* delta);
  /// Poses of the other map in the frame of this one, the first at or after `from_ns`.
  absl::StatusOr<std::vector<TimedPose>> Carried(TimeNs from_ns, TimeNs to_ns,
                                                 const StopCheck& stop) const;
  /// What earlier merges may have written of that span, each in its order.
  absl::StatusOr<std::vector<std::vector<TimedPose>>> CarriedBefore(TimeNs from_ns, TimeNs to_ns,
                                                                    const StopCheck& stop) const;
  /// Whether an earlier merge wrote this stay, and nobody else has.
  absl::StatusOr<bool> IsAsWritten(const Stay& known) const;
  absl::Status ReadStays(GraphDelta* delta);
  absl::Status ReadFactors(GraphDelta* delta) const;
  absl::Status ReadShapes(const StopCheck& stop, GraphDelta* delta);
  /// The empty id for a node that has none here.
  NodeId Mapped(NodeId theirs_id) const;

  const Snapshot& into_;
  const Snapshot& other_;
  const MergePlan& plan_;
  NodeId theirs_;
  NodeId mine_;
  Stage stage_ = Stage::kBegin;
  bool is_known_ = false;
  /// The other map as it was when this agent was copied from it; null if it was not, or nothing of
  /// it can have been corrected since.
  const std::vector<std::shared_ptr<const Snapshot>>* bases_ = nullptr;
  /// Others have gone on with the track here.
  bool has_own_end_ = false;
  TimeNs compared_to_ns_ = kTimeMin;
  TimeNs next_pose_ns_ = kTimeMin;
  TimeNs next_shape_ns_ = kTimeMin;
  std::vector<Sha256> topologies_;
};

}  // namespace dsg::merge
