// SPDX-License-Identifier: Apache-2.0
// Answers GetNeighbors, a node's edges with the nodes at their other ends, and BatchGetNodes.
#include <algorithm>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "query/engine/search/vocabulary.h"
#include "query/engine/view_nodes.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr int kBatchNodesMax = 1000;

// Compares as the answer is ordered: outgoing first, then by relation, then by the other end.
struct NeighborKey {
  bool is_incoming = false;
  std::string relation;
  NodeId other;
  auto operator<=>(const NeighborKey&) const = default;

  EdgeKey EdgeOf(NodeId node) const {
    return is_incoming ? EdgeKey{other, relation, node} : EdgeKey{node, relation, other};
  }
};

std::string NeighborPosition(const NeighborKey& key) {
  std::string position;
  AppendWord(key.is_incoming ? 1 : 0, &position);
  AppendWord(key.other.value, &position);
  return position + key.relation;
}

absl::StatusOr<NeighborKey> NeighborKeyOf(std::string_view position) {
  uint64_t is_incoming = 0;
  NeighborKey key;
  if (!TakeWord(&position, &is_incoming) || is_incoming > 1 ||
      !TakeWord(&position, &key.other.value)) {
    return PageTokenError();
  }
  key.is_incoming = is_incoming == 1;
  key.relation = std::string(position);
  return key;
}

struct NeighborQuestion {
  NodeId node;
  RelationSet relations;
  bool outgoing = true;
  bool incoming = true;
  std::optional<TimeNs> at_ns;
};

// Keys after `after`, the first `limit` of them ascending.
absl::StatusOr<std::vector<NeighborKey>> FindNeighbors(const GraphView& graph,
                                                       const NeighborQuestion& question,
                                                       const std::optional<NeighborKey>& after,
                                                       size_t limit, const CallContext& call) {
  constexpr size_t kStopEvery = 256;
  std::vector<NeighborKey> found;
  absl::Status status;
  size_t edge_count = 0;
  const auto visit = [&](const ViewEdge& edge, bool is_incoming) {
    if (++edge_count % kStopEvery == 0) status = call.Check();
    if (!status.ok()) return false;
    if (!question.relations.Has(edge.relation)) return true;
    const ViewNode* other = graph.FindNode(is_incoming ? edge.source : edge.target);
    if (other == nullptr) return true;
    if (question.at_ns.has_value() &&
        (!edge.valid.Contains(*question.at_ns) || !other->valid.Contains(*question.at_ns))) {
      return true;
    }
    NeighborKey key{is_incoming, graph.symbols().Text(edge.relation), other->id};
    if (!after.has_value() || *after < key) found.push_back(std::move(key));
    return true;
  };
  if (question.outgoing && !(after.has_value() && after->is_incoming)) {
    graph.ForEachEdgeFrom(question.node, [&](const ViewEdge& edge) { return visit(edge, false); });
  }
  // A page that outgoing edges fill needs no others.
  if (question.incoming && found.size() < limit) {
    graph.ForEachEdgeTo(question.node, [&](const ViewEdge& edge) { return visit(edge, true); });
  }
  DSG_RETURN_IF_ERROR(status);
  // The view goes by symbols, the answer by the relations' spelling.
  const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(limit, found.size()));
  std::partial_sort(found.begin(), end, found.end());
  found.erase(end, found.end());
  return found;
}

absl::Status FillNeighbor(const Snapshot& snapshot, const GraphView& graph, NodeId node,
                          const NeighborKey& key, InTurn<EdgeKey>* edges, NodeFiller* filler,
                          v1::Neighbor* out) {
  DSG_ASSIGN_OR_RETURN(const std::optional<Edge> edge, edges->Next(snapshot, {}));
  if (!edge.has_value()) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat("edge ", ToString(key.EdgeOf(node).source), " ", key.relation,
                                  " ", ToString(key.EdgeOf(node).target),
                                  " was listed but cannot be read; run `dsg verify`"),
                     {{"map", snapshot.spec().name}, {"table", "edge"}});
  }
  ToProto(*edge, out->mutable_edge());
  return filler->Fill(*graph.FindNode(key.other), out->mutable_node());
}

absl::StatusOr<NeighborQuestion> ReadNeighborQuestion(const ReadView& view, const GraphView& graph,
                                                      const v1::GetNeighborsRequest& request,
                                                      const StopCheck& stop) {
  NeighborQuestion question;
  DSG_ASSIGN_OR_RETURN(question.node, ResolveOne(view.snapshot(), request.id(), "id", stop));
  DSG_ASSIGN_OR_RETURN(
      question.relations,
      RelationSet::Resolve({request.relations().begin(), request.relations().end()}, graph, stop));
  if (request.outgoing() || request.incoming()) {
    question.outgoing = request.outgoing();
    question.incoming = request.incoming();
  }
  if (request.has_at_ns()) question.at_ns = request.at_ns();
  return question;
}

// The ids among the texts, whether or not there are such nodes.
std::vector<NodeId> IdsAmong(const google::protobuf::RepeatedPtrField<std::string>& texts) {
  std::vector<NodeId> ids;
  for (const std::string& text : texts) {
    const absl::StatusOr<NodeId> id = ParseNodeId(text);
    if (id.ok()) ids.push_back(*id);
  }
  return ids;
}

// `ids` are those that IdsAmong found and no call has taken yet.
absl::StatusOr<Node> ReadNode(const Snapshot& snapshot, const std::string& id_or_name,
                              InTurn<NodeId>* ids, const StopCheck& stop) {
  if (ParseNodeId(id_or_name).ok()) {
    DSG_ASSIGN_OR_RETURN(std::optional<Node> node, ids->Next(snapshot, stop));
    if (node.has_value()) return *std::move(node);
  }
  // A name, which may look like an id, or nothing.
  DSG_ASSIGN_OR_RETURN(const NodeId id, ResolveOne(snapshot, id_or_name, "ids", stop));
  return snapshot.GetNode(id);
}

}  // namespace

absl::Status GetNeighbors(Engine* engine, const CallContext& call,
                          const v1::GetNeighborsRequest& request, v1::GetNeighborsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("GetNeighbors", request));
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  std::optional<NeighborKey> after;
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(after, NeighborKeyOf(page.position));
  }
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(const auto graph, page.view.Graph(stop));
  DSG_ASSIGN_OR_RETURN(const NeighborQuestion question,
                       ReadNeighborQuestion(page.view, *graph, request, stop));
  const auto size = static_cast<size_t>(page.size);
  DSG_ASSIGN_OR_RETURN(const std::vector<NeighborKey> found,
                       FindNeighbors(*graph, question, after, size + 1, call));

  page.view.FillHeader(reply->mutable_header());
  const Snapshot& snapshot = page.view.snapshot();
  NodeFiller filler(snapshot, *graph, request.view());
  std::vector<NodeId> others;
  std::vector<EdgeKey> edge_keys;
  for (const NeighborKey& key : found) {
    others.push_back(key.other);
    edge_keys.push_back(key.EdgeOf(question.node));
  }
  filler.Expect(std::move(others));
  InTurn<EdgeKey> edges(edge_keys);
  size_t bytes = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    DSG_RETURN_IF_ERROR(call.Check());
    v1::Neighbor* out = reply->add_neighbors();
    DSG_RETURN_IF_ERROR(
        FillNeighbor(snapshot, *graph, question.node, found[i], &edges, &filler, out));
    bytes += out->ByteSizeLong();
    if (i + 1 < found.size() && (i + 1 == size || bytes > kPageBytesSoftMax)) {
      reply->set_next_page_token(page.NextToken(NeighborPosition(found[i])));
      break;
    }
  }
  return absl::OkStatus();
}

absl::Status BatchGetNodes(Engine* engine, const CallContext& call,
                           const v1::BatchGetNodesRequest& request,
                           v1::BatchGetNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  if (request.ids_size() > kBatchNodesMax) {
    return FieldError("ids", absl::StrCat(request.ids_size(), " long"),
                      absl::StrCat("give at most ", kBatchNodesMax));
  }
  // From the store: some nodes of a revision are not worth a view of all of it.
  const Snapshot& snapshot = view.snapshot();
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(snapshot));
  view.FillHeader(reply->mutable_header());
  const std::vector<NodeId> all_ids = IdsAmong(request.ids());
  InTurn<NodeId> ids(all_ids);
  size_t bytes = 0;
  for (const std::string& id : request.ids()) {
    DSG_RETURN_IF_ERROR(call.Check());
    v1::GetNodeResult* out = reply->add_results();
    const absl::StatusOr<Node> node = ReadNode(snapshot, id, &ids, call.stop());
    absl::Status status = node.status();
    if (status.ok()) FillNode(*node, layers, request.view(), out->mutable_node());
    // A store that cannot be read, and a deadline, are no matter of one id.
    if (ReasonOf(status) == Reason::kUnspecified || absl::IsDataLoss(status)) {
      DSG_RETURN_IF_ERROR(status);
    }
    if (!status.ok()) {
      out->set_status_code(static_cast<int>(status.code()));
      out->set_status_message(std::string(status.message()));
    }
    bytes += out->ByteSizeLong();
    if (bytes > kReplyBytesMax) {
      return FieldError("ids", absl::StrCat(request.ids_size(), " long"),
                        absl::StrCat("the first ", reply->results_size(),
                                     " nodes alone fill a reply; ask for fewer, or for a smaller "
                                     "view"));
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
