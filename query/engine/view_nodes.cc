// SPDX-License-Identifier: Apache-2.0
#include "query/engine/view_nodes.h"

#include <utility>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/nodes.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {

NodeFiller::NodeFiller(const Snapshot& snapshot, const GraphView& graph, int node_view)
    : snapshot_(snapshot), graph_(graph), layers_(graph.layers()), node_view_(node_view) {}

bool NodeFiller::IsInView() const {
  return node_view_ == v1::NODE_VIEW_BASIC || node_view_ == v1::NODE_VIEW_GEOMETRY;
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
