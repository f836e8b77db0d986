// SPDX-License-Identifier: Apache-2.0
// The deltas of a merge, one at a time, and how they follow concurrent changes of this map.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "schema/merge/merge.h"

namespace dsg::merge {

/// The deltas of a plan: assets, graph, tracks, stays and factors, shapes, mesh. Poses and blocks
/// are read on demand. An interrupted merge continues with a new plan, which knows by origins what
/// has been written.
///
/// Threads: one caller at a time.
class MergeDeltas {
 public:
  /// `part_count`: number of deltas that earlier plans of this merge have written, for messages.
  MergeDeltas(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
              MergePlan plan, std::string author, int64_t part_count = 0);
  ~MergeDeltas();

  const MergePlan& plan() const;
  /// The next delta; nullopt at the end. Sequences count from 1 in a session named after both
  /// revisions. A caller that may run concurrently with another merge of the same maps sets its own
  /// session.
  absl::StatusOr<std::optional<GraphDelta>> Next(const StopCheck& stop);
  /// Others have changed `into`, which is now `head`. Returns false if the rest of the plan no
  /// longer applies and has to be planned again.
  /// Errors: ABORTED/PARENT_REVISION_STALE when others have extended the track of an agent that
  /// this merge was to extend.
  absl::StatusOr<bool> Follow(const std::shared_ptr<const Snapshot>& head, const Touched& touched);
  /// From 0 to 1.
  double progress() const;
  /// Blocks so far that both maps had.
  int64_t fused_mesh_block_count() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::merge
