// SPDX-License-Identifier: Apache-2.0
// Which revisions a policy about history lets go.
#pragma once

#include "absl/status/statusor.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"

namespace dsg {

struct HistoryCut {
  /// The oldest revision to keep, at most the newest.
  Revision keep_from = 0;
  /// How many readable ones are before it and have no tag.
  int64_t revision_count = 0;
};

/// Requires: policy.IsHistory().
/// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE; what `stop` returned.
absl::StatusOr<HistoryCut> FindHistoryCut(MapReader* reader, Revision newest,
                                          const PrunePolicy& policy, int64_t wall_now_ns,
                                          const StopCheck& stop);

}  // namespace dsg
