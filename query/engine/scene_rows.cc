// SPDX-License-Identifier: Apache-2.0
#include "query/engine/scene_rows.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/scene.pb.h"
#include "query/engine/agents.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Nodes looked at between two questions to the call.
constexpr size_t kRowsCheckPeriod = 4096;

}  // namespace

absl::StatusOr<SceneRows> SceneRows::Choose(const ReadView& view,
                                            std::shared_ptr<const GraphView> graph,
                                            const v1::GetSceneRequest& request,
                                            const StopCheck& stop) {
  const int64_t most = request.nodes_per_layer_max();
  if (most < 0) {
    return FieldError("nodes_per_layer_max", absl::StrCat(most),
                      "give how many nodes of a layer to send at most, or 0 for all");
  }
  SceneRows rows;
  rows.graph_ = std::move(graph);
  if (request.has_at_ns()) {
    rows.at_ns_ = request.at_ns();
    DSG_RETURN_IF_ERROR(rows.LocateAgents(view, request.at_ns(), stop));
  }
  DSG_RETURN_IF_ERROR(rows.ChooseLayers(view, request));

  absl::flat_hash_map<LayerId, std::vector<const ViewNode*>> of_layer;
  for (const LayerRows& layer : rows.layers_) of_layer[layer.layer.id];
  absl::Status stopped;
  size_t count = 0;
  rows.graph_->ForEachNode(NodeId(), [&](const ViewNode& node) {
    if (++count % kRowsCheckPeriod == 0) stopped = AskStop(stop);
    const auto found = of_layer.find(node.layer);
    if (found != of_layer.end() && rows.IsWanted(node)) found->second.push_back(&node);
    return stopped.ok();
  });
  DSG_RETURN_IF_ERROR(stopped);

  for (LayerRows& layer : rows.layers_) {
    const std::vector<const ViewNode*>& all = of_layer[layer.layer.id];
    layer.node_count = static_cast<int64_t>(all.size());
    layer.begin = rows.nodes_.size();
    const size_t sent = most == 0 ? all.size() : std::min(all.size(), static_cast<size_t>(most));
    for (size_t i = 0; i < sent; ++i) rows.nodes_.push_back(all[i * all.size() / sent]);
    layer.end = rows.nodes_.size();
  }
  rows.Number();
  return rows;
}

absl::Status SceneRows::ChooseLayers(const ReadView& view, const v1::GetSceneRequest& request) {
  absl::flat_hash_set<LayerId> wanted;
  for (const std::string& name : request.layers()) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, view.snapshot().FindLayer(name));
    wanted.insert(layer.id);
  }
  for (const Layer& layer : graph_->layers()) {
    if (wanted.empty() || wanted.contains(layer.id)) layers_.push_back({layer});
  }
  // Stable: layers of one rank stay in the order of their names.
  std::stable_sort(layers_.begin(), layers_.end(), [](const LayerRows& a, const LayerRows& b) {
    return a.layer.rank > b.layer.rank;
  });
  return absl::OkStatus();
}

absl::Status SceneRows::LocateAgents(const ReadView& view, TimeNs at_ns, const StopCheck& stop) {
  NodeFilter filter;
  filter.at_ns = at_ns;
  DSG_ASSIGN_OR_RETURN(const std::vector<AgentAt> agents, AgentsAt(view.snapshot(), filter, stop));
  for (const AgentAt& agent : agents) {
    agents_[agent.node.id.value] =
        agent.is_in_gap ? std::nullopt : std::optional(agent.node.map_T_node);
  }
  return absl::OkStatus();
}

bool SceneRows::IsWanted(const ViewNode& node) const {
  if (!at_ns_.has_value()) return true;
  if (IsAgentKind(graph_->symbols().Text(node.kind))) return agents_.contains(node.id.value);
  return node.valid.Contains(*at_ns_);
}

void SceneRows::Number() {
  rows_.reserve(nodes_.size());
  for (size_t row = 0; row < nodes_.size(); ++row) {
    const ViewNode& node = *nodes_[row];
    rows_[node.id.value] = static_cast<uint32_t>(row);
    const std::optional<Pose3d> map_T_node = PoseOf(node);
    if (!map_T_node.has_value()) continue;
    bounds_map_.extend(node.box_node.isEmpty() ? Box3d(map_T_node->position)
                                               : TransformBox(*map_T_node, node.box_node));
  }
}

uint32_t SceneRows::RowOf(NodeId id) const {
  const auto found = rows_.find(id.value);
  return found == rows_.end() ? kNoRow : found->second;
}

std::optional<Pose3d> SceneRows::PoseOf(const ViewNode& node) const {
  const auto agent = agents_.find(node.id.value);
  return agent == agents_.end() ? std::optional(node.map_T_node) : agent->second;
}

}  // namespace dsg::query
