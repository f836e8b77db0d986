// SPDX-License-Identifier: Apache-2.0
#include "query/engine/nodes.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

absl::StatusOr<EdgeFilter> EdgeFilterFromProto(const v1::ListEdgesRequest& in,
                                               const Snapshot& snapshot, const StopCheck& stop) {
  EdgeFilter filter;
  if (!in.source().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.source, ResolveOne(snapshot, in.source(), "source", stop));
  }
  if (!in.target().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.target, ResolveOne(snapshot, in.target(), "target", stop));
  }
  filter.relation = in.relation();
  if (in.has_at_ns()) filter.at_ns = in.at_ns();
  return filter;
}

}  // namespace

EdgeFilter ChildrenOf(NodeId parent) {
  EdgeFilter filter;
  filter.source = parent;
  filter.relation = relations::kContains;
  return filter;
}

absl::Status ListEdges(Engine* engine, const CallContext& call, const v1::ListEdgesRequest& request,
                       v1::ListEdgesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListEdges", request));
  const Snapshot& snapshot = page.view.snapshot();
  DSG_ASSIGN_OR_RETURN(const EdgeFilter filter,
                       EdgeFilterFromProto(request, snapshot, call.stop()));
  std::optional<EdgeKey> after;
  if (!page.is_first()) {
    if (!ReadKey(page.position, &after.emplace())) return PageTokenError();
  }
  EdgeKey last;
  size_t bytes = 0;
  const auto take = [&](const Edge& edge) {
    if (reply->edges_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(KeyPosition(last)));
      return false;
    }
    v1::Edge* out = reply->add_edges();
    ToProto(edge, out);
    bytes += out->ByteSizeLong();
    last = edge.key();
    return true;
  };
  page.view.FillHeader(reply->mutable_header());
  return snapshot.ScanEdges(filter, after, call.stop(), take);
}

namespace {

absl::StatusOr<int64_t> CountChildren(const Snapshot& snapshot, NodeId id, const StopCheck& stop) {
  int64_t count = 0;
  DSG_RETURN_IF_ERROR(snapshot.ScanEdges(ChildrenOf(id), std::nullopt, stop, [&](const Edge&) {
    ++count;
    return true;
  }));
  return count;
}

}  // namespace

absl::Status CheckNodeView(int view) {
  if (v1::NodeView_IsValid(view)) return absl::OkStatus();
  return FieldError("view", absl::StrCat(view),
                    "give NODE_VIEW_ID, NODE_VIEW_BASIC, NODE_VIEW_GEOMETRY or NODE_VIEW_FULL");
}

void FillNode(const Node& node, const LayerTable& layers, int view, v1::Node* out) {
  if (view == v1::NODE_VIEW_ID) {
    out->set_id(ToString(node.id));
    return;
  }
  v1::Node full;
  v1::Node* filled = view == v1::NODE_VIEW_BASIC || view == v1::NODE_VIEW_GEOMETRY ? &full : out;
  ToProto(node, layers, filled);
  if (filled == out) return;
  out->set_id(full.id());
  out->set_layer(full.layer());
  out->set_kind(full.kind());
  out->set_name(full.name());
  if (full.has_semantic_class()) out->mutable_semantic_class()->Swap(full.mutable_semantic_class());
  if (full.has_valid_from_ns()) out->set_valid_from_ns(full.valid_from_ns());
  if (full.has_valid_to_ns()) out->set_valid_to_ns(full.valid_to_ns());
  if (view == v1::NODE_VIEW_BASIC) return;
  out->mutable_map_t_node()->Swap(full.mutable_map_t_node());
  if (full.has_bounding_box()) out->mutable_bounding_box()->Swap(full.mutable_bounding_box());
}

absl::StatusOr<LayerTable> LayersOf(const Snapshot& snapshot) {
  DSG_ASSIGN_OR_RETURN(std::vector<Layer> layers, snapshot.Layers());
  return LayerTable(std::move(layers));
}

absl::Status GetNode(Engine* engine, const CallContext& call, const v1::GetNodeRequest& request,
                     v1::GetNodeResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const Snapshot& snapshot = view.snapshot();
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const NodeId id, ResolveOne(snapshot, request.id(), "id", call.stop()));
  DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(id));
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(snapshot));
  DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> ancestors, snapshot.Ancestors(id));
  DSG_ASSIGN_OR_RETURN(const int64_t child_count, CountChildren(snapshot, id, call.stop()));

  view.FillHeader(reply->mutable_header());
  FillNode(node, layers, request.view(), reply->mutable_node());
  for (const NodeId ancestor : ancestors) reply->add_ancestor_ids(ToString(ancestor));
  reply->set_child_count(child_count);
  if (!IsAgentKind(node.kind)) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const TrackInfo track, snapshot.GetTrack(id));
  reply->set_pose_count(track.pose_count);
  if (track.pose_count > 0) {
    reply->set_first_pose_ns(track.first_ns);
    reply->set_last_pose_ns(track.last_ns);
  }
  return absl::OkStatus();
}

absl::Status ListNodes(Engine* engine, const CallContext& call, const v1::ListNodesRequest& request,
                       v1::ListNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListNodes", request));
  const Snapshot& snapshot = page.view.snapshot();
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const NodeFilter filter,
                       FilterFromProto(request.filter(), snapshot, call.stop()));
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(snapshot));
  NodeId last;
  if (!page.is_first()) {
    if (!ReadKey(page.position, &last)) return PageTokenError();
  }
  size_t bytes = 0;
  // False once the page is full.
  const auto add = [&](const Node& node, bool has_pose) {
    if (reply->nodes_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(KeyPosition(last)));
      return false;
    }
    v1::Node* out = reply->add_nodes();
    FillNode(node, layers, request.view(), out);
    if (!has_pose) out->clear_map_t_node();
    bytes += out->ByteSizeLong();
    last = node.id;
    return true;
  };
  // Agents of an instant stand where they were then, which the order of ids knows nothing of.
  std::vector<AgentAt> agents;
  if (filter.at_ns.has_value()) {
    DSG_ASSIGN_OR_RETURN(agents, AgentsAt(snapshot, filter, call.stop()));
  }
  auto next_agent =
      std::upper_bound(agents.begin(), agents.end(), last,
                       [](NodeId id, const AgentAt& agent) { return id < agent.node.id; });
  bool is_full = false;
  const auto add_agents_below = [&](std::optional<NodeId> bound) {
    for (; next_agent != agents.end() && (!bound.has_value() || next_agent->node.id < *bound);
         ++next_agent) {
      if (is_full = !add(next_agent->node, !next_agent->is_in_gap); is_full) return false;
    }
    return true;
  };
  page.view.FillHeader(reply->mutable_header());
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, last, call.stop(), [&](const Node& node) {
    if (filter.at_ns.has_value() && IsAgentKind(node.kind)) return true;
    if (!add_agents_below(node.id)) return false;
    is_full = !add(node, /*has_pose=*/true);
    return !is_full;
  }));
  if (!is_full) add_agents_below(std::nullopt);
  return absl::OkStatus();
}

}  // namespace dsg::query
