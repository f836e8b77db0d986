// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/graph_agents.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

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

}  // namespace

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
