// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/stays.h"

#include <algorithm>
#include <utility>

#include "schema/base/status.h"
#include "schema/model/known_names.h"

namespace dsg::query {

absl::StatusOr<const std::vector<NodeId>*> Stays::NodesOf(NodeId agent) {
  if (snapshot_ == nullptr) return &none_;
  if (const auto known = nodes_of_.find(agent); known != nodes_of_.end()) return &known->second;
  const Interval asked =
      at_ns_.has_value() ? Interval{*at_ns_, *at_ns_ + (*at_ns_ < kTimeMax)} : Interval();
  DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                       snapshot_->StaysOfAgent(agent, asked.from_ns, asked.to_ns));
  std::vector<NodeId> nodes;
  for (const Stay& stay : stays) {
    if (!stay.place.empty()) nodes.push_back(stay.place);
    if (!stay.room.empty()) nodes.push_back(stay.room);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return &nodes_of_.emplace(agent, std::move(nodes)).first->second;
}

absl::StatusOr<const std::vector<NodeId>*> Stays::AgentsIn(NodeId place_or_room) {
  if (!is_read_) {
    std::vector<NodeId> agents;
    view_.ForEachInLayer(layers::kAgents, [&](const ViewNode& node) {
      if (IsAgentKind(view_.symbols().Text(node.kind))) agents.push_back(node.id);
      return true;
    });
    std::sort(agents.begin(), agents.end());
    for (const NodeId agent : agents) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_ASSIGN_OR_RETURN(const std::vector<NodeId>* nodes, NodesOf(agent));
      for (const NodeId node : *nodes) agents_in_[node].push_back(agent);
    }
    is_read_ = true;
  }
  const auto found = agents_in_.find(place_or_room);
  return found == agents_in_.end() ? &none_ : &found->second;
}

}  // namespace dsg::query
