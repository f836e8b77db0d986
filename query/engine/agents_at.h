// SPDX-License-Identifier: Apache-2.0
// The people and robots of one instant, where they were then: their nodes know where they were
// last.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

struct AgentAt {
  /// Posed as its track has it then.
  Node node;
  /// Its track has a gap then: where it was nobody knows, and the pose means nothing.
  bool is_in_gap = false;
};

/// Agents that match `filter`, which names an instant between their first pose and their last. Of a
/// box only those that are known to have been in it.
/// Order: ascending id.
/// Cost: a look at each track that matches; there are hundreds of agents rather than millions.
/// Errors: of the store; what `stop` returned.
absl::StatusOr<std::vector<AgentAt>> AgentsAt(const Snapshot& snapshot, NodeFilter filter,
                                              const StopCheck& stop);

}  // namespace dsg::query
