// SPDX-License-Identifier: Apache-2.0
// Answers GetSubgraph: all that can be reached from a node, as a stream of nodes by distance, then
// the edges between them.
#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "query/engine/search/vocabulary.h"
#include "query/engine/view_nodes.h"
#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

// Edges that are looked at between two looks at the deadline.
constexpr size_t kStopEvery = 256;

struct SubgraphQuestion {
  NodeId root;
  std::vector<std::string> relations;
  bool both_directions = false;
  /// 0 = no limit.
  int depth_max = 0;
  NodeFilter filter;
  int node_view = 0;
  bool tree_only = false;
};

// An edge by which a node was reached first.
struct Step {
  NodeId node;
  bool is_incoming = false;
  Symbol relation = 0;
};

class SubgraphCursor final : public EngineCursor<v1::GetSubgraphResponse> {
 public:
  SubgraphCursor(const ReadView& view, SubgraphQuestion question)
      : view_(view), question_(std::move(question)) {}

  bool done() const override {
    return graph_ != nullptr && level_.empty() && edges_.done() && next_source_ == sources_.size();
  }

 private:
  absl::Status Fill(const CallContext& call, v1::GetSubgraphResponse* reply) override {
    if (graph_ == nullptr) {
      DSG_RETURN_IF_ERROR(Begin(call));
      view_.FillHeader(reply->mutable_header());
    }
    size_t bytes = 0;
    while (!done() && bytes < kPageBytesSoftMax) {
      DSG_RETURN_IF_ERROR(call.Check());
      if (next_in_level_ < level_.size()) {
        DSG_RETURN_IF_ERROR(SendNode(reply, &bytes));
      } else if (!level_.empty()) {
        DSG_RETURN_IF_ERROR(GoDeeper(call));
      } else if (!edges_.done()) {
        DSG_RETURN_IF_ERROR(SendEdge(call, reply, &bytes));
      } else {
        DSG_RETURN_IF_ERROR(FindEdges(call));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Begin(const CallContext& call) {
    DSG_ASSIGN_OR_RETURN(auto graph, view_.Graph(call.stop()));
    DSG_ASSIGN_OR_RETURN(relations_,
                         RelationSet::Resolve(question_.relations, *graph, call.stop()));
    filter_ = std::make_unique<ViewFilter>(question_.filter, *graph);
    filler_ = std::make_unique<NodeFiller>(view_.snapshot(), *graph, question_.node_view);
    graph_ = std::move(graph);
    level_ = {question_.root};
    filler_->Expect(level_);
    reached_ = {question_.root};
    return absl::OkStatus();
  }

  absl::Status SendNode(v1::GetSubgraphResponse* reply, size_t* bytes) {
    const ViewNode& node = *graph_->FindNode(level_[next_in_level_++]);
    v1::Node* out = reply->add_nodes();
    if (MovesWithTime(node)) {
      DSG_ASSIGN_OR_RETURN(const auto located, LocateAgent(node.id));
      const bool is_known = located.has_value() && located->quality != PoseQuality::kInGap;
      DSG_RETURN_IF_ERROR(
          filler_->Fill(node, is_known ? std::optional(located->map_T_agent) : std::nullopt, out));
      if (!is_known) out->clear_map_t_node();
    } else {
      DSG_RETURN_IF_ERROR(filler_->Fill(node, out));
    }
    *bytes += out->ByteSizeLong();
    return absl::OkStatus();
  }

  // The next level, or, where there is none, the edges.
  absl::Status GoDeeper(const CallContext& call) {
    std::vector<NodeId> deeper;
    if (question_.depth_max == 0 || depth_ < question_.depth_max) {
      for (const NodeId from : level_) {
        DSG_ASSIGN_OR_RETURN(const std::vector<Step> steps, StepsFrom(from, call));
        for (const Step& step : steps) {
          if (!reached_.insert(step.node).second) continue;
          deeper.push_back(step.node);
          if (question_.tree_only) tree_edges_.push_back(KeyOf(from, step));
        }
      }
      DSG_RETURN_IF_ERROR(SortStoppably(std::less<>(), call.stop(), &deeper));
    }
    ++depth_;
    level_ = std::move(deeper);
    next_in_level_ = 0;
    filler_->Expect(level_);
    if (!level_.empty()) return absl::OkStatus();
    if (question_.tree_only) {
      DSG_RETURN_IF_ERROR(SortStoppably(std::less<>(), call.stop(), &tree_edges_));
      edges_ = InTurn<EdgeKey>(tree_edges_);
    } else {
      sources_.assign(reached_.begin(), reached_.end());
      DSG_RETURN_IF_ERROR(SortStoppably(std::less<>(), call.stop(), &sources_));
    }
    return absl::OkStatus();
  }

  // Edges to new nodes, one a node: outgoing before incoming, then by the relation's spelling.
  absl::StatusOr<std::vector<Step>> StepsFrom(NodeId from, const CallContext& call) {
    std::vector<Step> steps;
    absl::Status status;
    const auto visit = [&](const ViewEdge& edge, bool is_incoming) {
      if (++looked_at_ % kStopEvery == 0) status = call.Check();
      if (!status.ok()) return false;
      const NodeId other = is_incoming ? edge.source : edge.target;
      if (!relations_.Has(edge.relation) || !HoldsNow(edge.valid) || reached_.contains(other)) {
        return true;
      }
      const ViewNode* node = graph_->FindNode(other);
      if (node == nullptr) return true;
      const absl::StatusOr<bool> matches = Matches(*node);
      status = matches.status();
      if (status.ok() && *matches) steps.push_back({other, is_incoming, edge.relation});
      return status.ok();
    };
    graph_->ForEachEdgeFrom(from, [&](const ViewEdge& edge) { return visit(edge, false); });
    if (question_.both_directions && status.ok()) {
      graph_->ForEachEdgeTo(from, [&](const ViewEdge& edge) { return visit(edge, true); });
    }
    DSG_RETURN_IF_ERROR(status);
    const SymbolTable& symbols = graph_->symbols();
    std::sort(steps.begin(), steps.end(), [&symbols](const Step& a, const Step& b) {
      if (a.node != b.node) return a.node < b.node;
      if (a.is_incoming != b.is_incoming) return !a.is_incoming;
      return symbols.Text(a.relation) < symbols.Text(b.relation);
    });
    const auto same_node = [](const Step& a, const Step& b) { return a.node == b.node; };
    steps.erase(std::unique(steps.begin(), steps.end(), same_node), steps.end());
    return steps;
  }

  // Agents of an instant stand where their tracks put them.
  bool MovesWithTime(const ViewNode& node) const {
    return question_.filter.at_ns.has_value() && IsAgentKind(graph_->symbols().Text(node.kind));
  }

  absl::StatusOr<std::optional<LocatedPose>> LocateAgent(NodeId agent) const {
    return LocateAt(view_.snapshot(), agent, *question_.filter.at_ns);
  }

  absl::StatusOr<bool> Matches(const ViewNode& node) const {
    if (!MovesWithTime(node)) return filter_->Matches(node);
    DSG_ASSIGN_OR_RETURN(const auto located, LocateAgent(node.id));
    if (!located.has_value()) return false;
    if (located->quality == PoseQuality::kInGap) {
      return !question_.filter.box_map.has_value() && filter_->Matches(node);
    }
    ViewNode placed = node;
    placed.map_T_node = located->map_T_agent;
    return filter_->Matches(placed);
  }

  bool HoldsNow(const Interval& valid) const {
    return !question_.filter.at_ns.has_value() || valid.Contains(*question_.filter.at_ns);
  }

  EdgeKey KeyOf(NodeId from, const Step& step) const {
    const std::string& relation = graph_->symbols().Text(step.relation);
    return step.is_incoming ? EdgeKey{step.node, relation, from}
                            : EdgeKey{from, relation, step.node};
  }

  absl::Status SendEdge(const CallContext& call, v1::GetSubgraphResponse* reply, size_t* bytes) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Edge> edge,
                         edges_.Next(view_.snapshot(), call.stop()));
    if (!edge.has_value()) return absl::OkStatus();
    v1::Edge* out = reply->add_edges();
    ToProto(*edge, out);
    *bytes += out->ByteSizeLong();
    return absl::OkStatus();
  }

  // The edges among the reached nodes that begin at some of them: of whole sources, ascending.
  absl::Status FindEdges(const CallContext& call) {
    constexpr size_t kEnough = 1024;
    std::vector<EdgeKey> keys;
    absl::Status status;
    while (status.ok() && next_source_ < sources_.size() && keys.size() < kEnough) {
      const auto of_source = static_cast<std::ptrdiff_t>(keys.size());
      graph_->ForEachEdgeFrom(sources_[next_source_++], [&](const ViewEdge& edge) {
        if (++looked_at_ % kStopEvery == 0) status = call.Check();
        if (reached_.contains(edge.target) && HoldsNow(edge.valid)) {
          keys.push_back({edge.source, graph_->symbols().Text(edge.relation), edge.target});
        }
        return status.ok();
      });
      std::sort(keys.begin() + of_source, keys.end());
    }
    DSG_RETURN_IF_ERROR(status);
    edge_keys_ = std::move(keys);
    edges_ = InTurn<EdgeKey>(edge_keys_);
    return absl::OkStatus();
  }

  const ReadView view_;
  const SubgraphQuestion question_;
  // Set by the first Next, which has a deadline to make them in.
  std::shared_ptr<const GraphView> graph_;
  RelationSet relations_;
  std::unique_ptr<ViewFilter> filter_;
  std::unique_ptr<NodeFiller> filler_;

  // Ids only: nodes and edges are read when they are sent.
  std::unordered_set<NodeId> reached_;
  std::vector<NodeId> level_;
  size_t next_in_level_ = 0;
  int depth_ = 0;
  size_t looked_at_ = 0;
  std::vector<EdgeKey> tree_edges_;
  std::vector<EdgeKey> edge_keys_;
  InTurn<EdgeKey> edges_;
  std::vector<NodeId> sources_;
  size_t next_source_ = 0;
};

}  // namespace

CursorOr<v1::GetSubgraphResponse> GetSubgraph(Engine* engine, const CallContext& call,
                                              const v1::GetSubgraphRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  SubgraphQuestion question;
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  if (request.depth_max() < 0) {
    return FieldError("depth_max", absl::StrCat(request.depth_max()),
                      "give 1 or more edges, or 0 for no limit");
  }
  if (!request.filter().name().empty() || !request.filter().parent_id().empty()) {
    return FieldError("filter", "by name or parent",
                      "a walk is narrowed by layer, kind, class_name, box and at_ns");
  }
  DSG_ASSIGN_OR_RETURN(question.filter,
                       FilterFromProto(request.filter(), view.snapshot(), call.stop()));
  DSG_ASSIGN_OR_RETURN(question.root,
                       ResolveOne(view.snapshot(), request.root(), "root", call.stop()));
  question.relations.assign(request.relations().begin(), request.relations().end());
  if (question.relations.empty()) question.relations = {relations::kContains};
  question.both_directions = request.both_directions();
  question.depth_max = request.depth_max();
  question.node_view = request.view();
  question.tree_only = request.tree_only();
  return std::make_unique<SubgraphCursor>(view, std::move(question));
}

}  // namespace dsg::query
