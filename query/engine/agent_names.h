// SPDX-License-Identifier: Apache-2.0
// Which agent a text names, remembered per opened map and revision: looking a name up in the store
// costs several times as much as finding where the agent was.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/engine/bounded_cache.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Threads: safe from many threads.
class AgentNames {
 public:
  /// As Snapshot::ResolveAgent. Only names that exist are remembered, so callers cannot fill the
  /// memory with invented ones. Errors: AGENT_UNKNOWN; FIELD_INVALID for an empty text.
  absl::StatusOr<NodeId> Resolve(const Snapshot& snapshot, const std::string& id_or_name);

 private:
  struct Key {
    uint64_t opening = 0;
    Revision revision = 0;
    std::string id_or_name;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    size_t operator()(const Key& key) const noexcept;
  };

  BoundedCache<Key, NodeId, KeyHash> entries_{65'536};
};

}  // namespace dsg::query
