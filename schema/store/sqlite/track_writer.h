// SPDX-License-Identifier: Apache-2.0
// Writes trajectories: tracks that grow at their ends, and corrections, which write only the
// segments anew that they touch.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "schema/codec/trajectory_codec.h"
#include "schema/model/graph_delta.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// Writes trajectories. Keeps the open tail of each track between commits; after a failed commit
/// it must be forgotten.
class TrackWriter {
 public:
  TrackWriter();
  ~TrackWriter();

  absl::Status Append(const TrajectoryAppend& append, CommitContext* commit);
  absl::Status Correct(const TrajectoryCorrection& correction, CommitContext* commit);
  /// The agent never existed: its poses end with this revision.
  absl::Status End(NodeId agent, CommitContext* commit);
  void Forget();

 private:
  struct Tail;
  absl::StatusOr<Tail*> LoadTail(NodeId agent, CommitContext* commit);
  absl::Status LoadOpenSegment(Tail* tail, CommitContext* commit);
  absl::Status AppendPose(const StoredPose& pose, Tail* tail, CommitContext* commit);
  absl::Status WriteSegment(Tail* tail, CommitContext* commit);
  /// The track ends with `tail` from this revision on.
  absl::Status EndAtMark(const Tail& tail, CommitContext* commit);
  absl::Status TakeSegments(TimeNs from_ns, TimeNs to_ns, Tail* tail,
                            std::vector<StoredPose>* poses, int64_t* next_id,
                            CommitContext* commit);
  absl::Status LoadSegmentBefore(int64_t next_id, Tail* tail, CommitContext* commit);
  absl::Status WriteBetween(std::vector<StoredPose> poses, int64_t next_id, Tail* tail,
                            CommitContext* commit);

  std::unordered_map<NodeId, std::unique_ptr<Tail>> tails_;
};

}  // namespace dsg::sqlite
