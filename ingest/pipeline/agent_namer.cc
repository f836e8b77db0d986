// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/agent_namer.h"

#include <algorithm>
#include <charconv>

namespace dsg::ingest {
namespace {

constexpr uint64_t kIndexFromNameMax = 999'999;

// True for "0", "7", "42", not for "07" or "4x": then name and id read the same.
bool IsCanonicalIndex(std::string_view name, uint64_t* index) {
  if (name.size() > 1 && name[0] == '0') return false;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), *index);
  return error == std::errc() && end == name.data() + name.size() && *index <= kIndexFromNameMax;
}

}  // namespace

AgentNamer::AgentNamer(const std::vector<Node>& known) {
  // The first of several agents that share a name, so the lowest id when `known` is in order.
  for (const Node& agent : known) Take(agent.id, agent.name, agent.kind);
}

NodeId AgentNamer::Assign(std::string_view name, std::string_view kind) {
  return AssignPreferring(NodeId(), name, kind);
}

NodeId AgentNamer::AssignPreferring(NodeId preferred, std::string_view name,
                                    std::string_view kind) {
  const auto known = id_of_.find(std::pair(std::string(name), std::string(kind)));
  if (known != id_of_.end()) return known->second;
  if (!preferred.empty() && !taken_.contains(preferred)) return Take(preferred, name, kind);
  const char letter = kind == kinds::kRobot ? 'r' : 'H';
  uint64_t index = 0;
  if (IsCanonicalIndex(name, &index) && !taken_.contains(NodeId(letter, index))) {
    return Take(NodeId(letter, index), name, kind);
  }
  const auto largest = largest_index_.find(letter);
  return Take(NodeId(letter, largest == largest_index_.end() ? 0 : largest->second + 1), name,
              kind);
}

NodeId AgentNamer::Take(NodeId id, std::string_view name, std::string_view kind) {
  id_of_.try_emplace(std::pair(std::string(name), std::string(kind)), id);
  taken_.insert(id);
  uint64_t& largest = largest_index_[id.letter()];
  largest = std::max(largest, id.index());
  return id;
}

}  // namespace dsg::ingest
