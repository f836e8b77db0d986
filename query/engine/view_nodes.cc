// SPDX-License-Identifier: Apache-2.0
#include "query/engine/view_nodes.h"

#include <utility>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {

ViewFilter::ViewFilter(const NodeFilter& filter, const GraphView& graph)
    : filter_(filter), graph_(graph) {
  const auto find = [&](const std::string& text) {
    if (text.empty()) return std::optional<Symbol>();
    const std::optional<Symbol> symbol = graph.symbols().Find(text);
    can_match_ = can_match_ && symbol.has_value();
    return symbol;
  };
  kind_ = find(filter.kind);
  class_name_ = find(filter.class_name);
  name_ = find(filter.name);
}

bool ViewFilter::Matches(const ViewNode& node) const {
  return can_match_ && (!filter_.layer.has_value() || node.layer == *filter_.layer) &&
         (!kind_.has_value() || node.kind == *kind_) &&
         (!class_name_.has_value() || node.class_name == *class_name_) &&
         (!name_.has_value() || node.name == *name_) &&
         (!filter_.at_ns.has_value() || node.valid.Contains(*filter_.at_ns)) &&
         (!filter_.box_map.has_value() || node.BoxMap().intersects(*filter_.box_map)) &&
         (filter_.parent.empty() || IsChild(node.id));
}

bool ViewFilter::IsChild(NodeId node) const {
  const std::optional<Symbol> contains = graph_.symbols().Find(relations::kContains);
  bool is_child = false;
  if (!contains.has_value()) return false;
  graph_.ForEachEdgeTo(node, *contains, [&](const ViewEdge& edge) {
    is_child = edge.source == filter_.parent;
    return !is_child;
  });
  return is_child;
}

NodeFiller::NodeFiller(const Snapshot& snapshot, const GraphView& graph, int node_view)
    : snapshot_(snapshot), graph_(graph), layers_(graph.layers()), node_view_(node_view) {}

bool NodeFiller::IsInView() const {
  return node_view_ != v1::NODE_VIEW_UNSPECIFIED && node_view_ != v1::NODE_VIEW_FULL;
}

Node NodeFiller::FromView(const ViewNode& node) const {
  const SymbolTable& symbols = graph_.symbols();
  Node full;
  full.id = node.id;
  full.layer = node.layer;
  full.kind = symbols.Text(node.kind);
  full.name = symbols.Text(node.name);
  full.class_id = node.class_id;
  full.class_name = symbols.Text(node.class_name);
  full.map_T_node = node.map_T_node;
  full.box_node = node.box_node;
  full.valid = node.valid;
  return full;
}

void NodeFiller::Expect(std::vector<NodeId> ids) {
  if (IsInView()) return;
  expected_ids_ = std::move(ids);
  expected_ = InTurn<NodeId>(expected_ids_);
}

absl::StatusOr<Node> NodeFiller::FromStore(NodeId id) {
  if (expected_.done() || expected_.key() != id) return snapshot_.GetNode(id);
  DSG_ASSIGN_OR_RETURN(std::optional<Node> node, expected_.Next(snapshot_, {}));
  // Says that there is none.
  if (!node.has_value()) return snapshot_.GetNode(id);
  return *std::move(node);
}

absl::Status NodeFiller::Fill(const ViewNode& node, const std::optional<Pose3d>& map_T_agent,
                              v1::Node* out) {
  Node full;
  if (IsInView()) {
    full = FromView(node);
  } else {
    DSG_ASSIGN_OR_RETURN(full, FromStore(node.id));
  }
  if (map_T_agent.has_value()) full.map_T_node = *map_T_agent;
  FillNode(full, layers_, node_view_, out);
  return absl::OkStatus();
}

}  // namespace dsg::query
