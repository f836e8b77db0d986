// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/agent_namer.h"

#include <algorithm>
#include <charconv>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kIndexFromNameMax = 999'999;

// True for "0", "7", "42", not for "07" or "4x": then name and id read the same.
bool IsCanonicalIndex(std::string_view name, uint64_t* index) {
  if (name.size() > 1 && name[0] == '0') return false;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), *index);
  return error == std::errc() && end == name.data() + name.size() && *index <= kIndexFromNameMax;
}

// The id that a name tells: of "7" and "H7" H7, if H is the letter; else empty.
NodeId IdInName(std::string_view name, char letter) {
  uint64_t index = 0;
  if (IsCanonicalIndex(name, &index)) return NodeId(letter, index);
  const absl::StatusOr<NodeId> id = ParseNodeId(name);
  return id.ok() && id->letter() == letter ? *id : NodeId();
}

using NewIds = std::unordered_map<NodeId, NodeId>;

void Replace(const NewIds& new_ids, NodeId* id) {
  const auto found = new_ids.find(*id);
  if (found != new_ids.end()) *id = found->second;
}

void ReplaceEverywhere(const NewIds& new_ids, GraphDelta* delta) {
  for (Node& node : delta->nodes) Replace(new_ids, &node.id);
  for (Edge& edge : delta->edges) {
    Replace(new_ids, &edge.source);
    Replace(new_ids, &edge.target);
  }
  for (TrajectoryAppend& append : delta->appends) Replace(new_ids, &append.agent);
  for (TrajectoryCorrection& item : delta->corrections) Replace(new_ids, &item.agent);
  for (FactorAppend& item : delta->factors) {
    Replace(new_ids, &item.agent);
    for (PoseFactor& factor : item.factors) Replace(new_ids, &factor.to_agent);
  }
  for (ShapeAppend& item : delta->shapes) Replace(new_ids, &item.agent);
  for (Stay& stay : delta->stays) Replace(new_ids, &stay.agent);
}

char LetterOf(std::string_view kind) {
  if (kind == kinds::kRobot) return 'r';
  if (kind == kinds::kVehicle) return 'V';
  return kind == kinds::kAnimal ? 'N' : 'H';
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
  const NodeId id = FindOrTake(preferred, name, kind);
  const absl::StatusOr<NodeId> meant = ParseNodeId(name);
  if (meant.ok() && *meant != id) misleading_.try_emplace(std::string(name), id);
  return id;
}

NodeId AgentNamer::FindOrTake(NodeId preferred, std::string_view name, std::string_view kind) {
  const auto known = id_of_.find(std::pair(std::string(name), std::string(kind)));
  if (known != id_of_.end()) return known->second;
  if (!preferred.empty() && !taken_.contains(preferred)) return Take(preferred, name, kind);
  const char letter = LetterOf(kind);
  const NodeId named = IdInName(name, letter);
  if (!named.empty() && !taken_.contains(named)) return Take(named, name, kind);
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

absl::Status RenameAgents(AgentNamer* namer, GraphDelta* delta) {
  std::vector<const Node*> agents;
  for (const Node& node : delta->nodes) {
    if (IsAgentKind(node.kind)) agents.push_back(&node);
  }
  std::sort(agents.begin(), agents.end(),
            [](const Node* a, const Node* b) { return a->id < b->id; });
  NewIds new_ids;
  std::unordered_set<NodeId> given;
  for (const Node* agent : agents) {
    const NodeId id = namer->AssignPreferring(agent->id, agent->name, agent->kind);
    if (!given.insert(id).second) {
      return MakeError(Reason::kFileMalformed,
                       absl::StrCat("agent ", ToString(agent->id), ": another ", agent->kind,
                                    " of the graph is named \"", agent->name,
                                    "\" too; give them names of their own"));
    }
    if (id != agent->id) new_ids[agent->id] = id;
  }
  if (!new_ids.empty()) ReplaceEverywhere(new_ids, delta);
  return absl::OkStatus();
}

}  // namespace dsg::ingest
