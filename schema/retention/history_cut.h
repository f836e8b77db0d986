// SPDX-License-Identifier: Apache-2.0
// Which revisions a policy about history lets go.
#pragma once

#include <string>

#include "absl/status/statusor.h"
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

}  // namespace dsg
