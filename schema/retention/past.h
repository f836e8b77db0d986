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
  /// How many readable ones are before it and have no tag.
  int64_t revision_count = 0;
  /// Says where the wall clock was not believed; empty if it was.
  std::string note;
};

/// The age of a revision is the sum of the steps of the wall clock from commit to commit, and from
/// the newest to `wall_now_ns`. A step back, or one by more than kClockLeapMaxNs, counts as no
/// time: the clock may have been set, and what went too early would not come back. So a revision
/// counts as younger than it is by the pauses of more than a week after it, and never as older.
///
/// Requires: policy.IsHistory().
/// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE; what `stop` returned.
absl::StatusOr<HistoryCut> FindHistoryCut(MapReader* reader, Revision newest,
                                          const PrunePolicy& policy, int64_t wall_now_ns,
                                          const StopCheck& stop);

/// Adds what the policy matches at the revision of the plan.
void AddPresent(const GraphIndex& index, const Measured& measured, Erasure* erasure);

/// Adds what it matched before.
/// Cost: looks at what each readable revision ended.
absl::Status AddPast(MapReader* reader, const Snapshot& map, const GraphIndex& index,
                     const PrunePolicy& policy, const StopCheck& stop, Erasure* erasure);

/// Oldest first, up to `newest`.
absl::StatusOr<std::vector<Revision>> ReadableRevisions(MapReader* reader, Revision newest,
                                                        const StopCheck& stop);

/// Whether the node that a branch policy names was there at any readable revision.
absl::StatusOr<bool> WasEverThere(MapReader* reader, const Snapshot& map, const PrunePolicy& policy,
                                  const StopCheck& stop);

/// Sorts, and leaves out what stands twice.
void Normalize(Erasure* erasure);
/// Names also what `other` names.
void Join(const Erasure& other, Erasure* erasure);
/// Names nothing.
bool IsEmpty(const Erasure& erasure);

}  // namespace dsg
