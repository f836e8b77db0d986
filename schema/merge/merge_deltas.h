// SPDX-License-Identifier: Apache-2.0
// The deltas of a merge, one at a time, and how they follow concurrent changes of this map.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "schema/merge/merge.h"

namespace dsg::merge {

/// The deltas of a plan, one at a time: assets, graph, tracks, stays and factors, shapes, mesh.
/// Poses and blocks are read as they are needed. A merge that was cut short goes on with a new
/// plan: what has been written is known by its origins.
///
/// Threads: one caller at a time.
class MergeDeltas {
 public:
  /// `part_count`: how many parts of the merge an earlier plan has written, for messages.
  MergeDeltas(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
              MergePlan plan, std::string author, int64_t part_count = 0);
  ~MergeDeltas();

  const MergePlan& plan() const;
  /// nullopt at the end. Sequences count from 1 in a session named after both revisions: who may
  /// meet another merge of the same maps names a session of his own.
  absl::StatusOr<std::optional<GraphDelta>> Next(const StopCheck& stop);
  /// Others have changed `into`, which is now `head`. False if what is left of the plan does not
  /// hold any more: then what was not written has to be planned anew.
  /// Errors: ABORTED/PARENT_REVISION_STALE when an agent whose track is to go on with that of the
  /// other map has gone on already.
  absl::StatusOr<bool> Follow(const std::shared_ptr<const Snapshot>& head, const Touched& touched);
  /// From 0 to 1.
  double progress() const;
  /// Blocks that both maps had, so far.
  int64_t fused_mesh_block_count() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::merge
