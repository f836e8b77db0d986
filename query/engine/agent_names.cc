// SPDX-License-Identifier: Apache-2.0
#include "query/engine/agent_names.h"

#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {

size_t AgentNames::KeyHash::operator()(const Key& key) const noexcept {
  const size_t hash = std::hash<std::string>()(key.id_or_name) * 31 + key.opening;
  return hash * 31 + static_cast<size_t>(key.revision);
}

absl::StatusOr<NodeId> AgentNames::Resolve(const Snapshot& snapshot,
                                           const std::string& id_or_name) {
  if (id_or_name.empty()) {
    return FieldError("agent", "", "give a node id such as H12, or the name that the log gave");
  }
  const Key key{snapshot.opening(), snapshot.revision(), id_or_name};
  if (const auto known = entries_.Find(key)) return *known;
  DSG_ASSIGN_OR_RETURN(const NodeId id, snapshot.ResolveAgent(id_or_name));
  entries_.Insert(key, id);
  return id;
}

}  // namespace dsg::query
