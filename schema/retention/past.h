// SPDX-License-Identifier: Apache-2.0
// Policies and the past: the revisions that a history policy drops, and what an erasing policy
// removes from older revisions. Gone entities match by their last state; tracks and meshes by their
// state in each revision. So a prune that stopped between retiring and erasing finds the rest. The
// past of an entity that is elsewhere now stays.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/measure.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"

namespace dsg {

struct HistoryCut {
  /// The oldest revision to keep, at most the newest.
  Revision keep_from = 0;
  /// Number of readable revisions before it that have no tag.
  int64_t revision_count = 0;
  /// Where the wall clock was not trusted, in words; empty if nowhere.
  std::string note;
};

/// The age of a revision is the sum of the steps of the wall clock from commit to commit, up to
/// `wall_now_ns`. A step back, or one of more than kClockLeapMaxNs, counts as zero: the clock may
/// have been set, and dropped revisions do not come back. So pauses of more than a week make a
/// revision count as younger than it is, never as older.
///
/// Requires: policy.IsHistory().
/// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE; what `stop` returned.
absl::StatusOr<HistoryCut> FindHistoryCut(MapReader* reader, Revision newest,
                                          const PrunePolicy& policy, int64_t wall_now_ns,
                                          const StopCheck& stop);

/// Adds what the policy matches at the revision of the plan.
void AddPresent(const GraphIndex& index, const Measured& measured, Erasure* erasure);

/// Adds what the policy matches in older revisions.
/// Cost: looks at what each readable revision ended.
absl::Status AddPast(MapReader* reader, const Snapshot& map, const GraphIndex& index,
                     const PrunePolicy& policy, const StopCheck& stop, Erasure* erasure);

/// The readable revisions up to `newest`. Order: oldest first.
absl::StatusOr<std::vector<Revision>> ReadableRevisions(MapReader* reader, Revision newest,
                                                        const StopCheck& stop);

/// Whether the node of a branch policy existed at any readable revision.
absl::StatusOr<bool> WasEverThere(MapReader* reader, const Snapshot& map, const PrunePolicy& policy,
                                  const StopCheck& stop);

/// Sorts, and removes duplicates.
void Normalize(Erasure* erasure);
/// Adds `other`.
void Join(const Erasure& other, Erasure* erasure);
/// Whether it erases nothing.
bool IsEmpty(const Erasure& erasure);

}  // namespace dsg
