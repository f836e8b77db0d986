// SPDX-License-Identifier: Apache-2.0
// Answers SearchNodes: nodes by class, name, colour, attribute, relation and containment. A word
// that the map does not know is an error that lists what is near in spelling.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/query_language.h"
#include "query/engine/search/search_run.h"
#include "query/engine/view_nodes.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

std::string HitPosition(const HitKey& key) {
  std::string position;
  AppendWord(std::bit_cast<uint64_t>(key.distance_m), &position);
  AppendWord(key.id.value, &position);
  return position;
}

absl::StatusOr<HitKey> HitKeyOf(std::string_view position) {
  uint64_t distance_bits = 0;
  HitKey key;
  if (!TakeWord(&position, &distance_bits) || !TakeWord(&position, &key.id.value) ||
      !position.empty()) {
    return PageTokenError();
  }
  key.distance_m = std::bit_cast<double>(distance_bits);
  if (!std::isfinite(key.distance_m) || key.distance_m < 0.0) return PageTokenError();
  return key;
}

absl::StatusOr<NodePattern> ReadPattern(const v1::SearchNodesRequest& request) {
  switch (request.what_case()) {
    case v1::SearchNodesRequest::kQuery:
      return ParseQuery(request.query());
    case v1::SearchNodesRequest::kPattern:
      return NodePatternFromProto(request.pattern());
    case v1::SearchNodesRequest::WHAT_NOT_SET:
      break;
  }
  return FieldError("query", "",
                    "say what to look for, as a query or as a pattern; the query \"any\" finds "
                    "all nodes");
}

// Checks that need no map.
absl::StatusOr<SearchQuestion> ReadSearchQuestion(const Page& page,
                                                  const v1::SearchNodesRequest& request) {
  SearchQuestion question;
  if (request.has_near()) {
    DSG_ASSIGN_OR_RETURN(question.near_map, PointFromProto(request.near(), "near"));
  }
  const double max_distance_m = request.max_distance_m();
  if (!std::isfinite(max_distance_m) || max_distance_m < 0.0) {
    return FieldError("max_distance_m", absl::StrCat(max_distance_m),
                      "give finite metres, or 0 for no limit");
  }
  if (max_distance_m > 0.0) {
    if (!request.has_near()) {
      return FieldError("max_distance_m", absl::StrCat(max_distance_m),
                        "it needs the point to measure from, near");
    }
    question.distance_m_max = max_distance_m;
  }
  if (request.has_box()) {
    DSG_ASSIGN_OR_RETURN(question.box_map, BoxFromProto(request.box(), "box"));
  }
  if (request.has_at_ns()) question.at_ns = request.at_ns();
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(question.after, HitKeyOf(page.position));
  }
  question.limit = page.size;
  question.count_only = request.count_only();
  question.explain = request.explain();
  return question;
}

// What is above an agent while it stays somewhere, nearest first. Where the hierarchy does not put
// the place below the room, the stay is believed.
std::vector<NodeId> AncestorsOf(const Stay& stay, const GraphView& graph) {
  std::vector<NodeId> ids;
  const bool has_place = graph.FindNode(stay.place) != nullptr;
  if (has_place) ids = graph.Ancestors(stay.place);
  if (graph.FindNode(stay.room) != nullptr && std::ranges::count(ids, stay.room) == 0) {
    ids = graph.Ancestors(stay.room);
    ids.insert(ids.begin(), stay.room);
  }
  if (has_place) ids.insert(ids.begin(), stay.place);
  return ids;
}

absl::StatusOr<std::vector<NodeId>> AncestorsOf(const Hit& hit, const SearchQuestion& question,
                                                const GraphView& graph) {
  const bool is_agent_then = hit.map_T_agent.has_value() || hit.is_in_gap;
  if (!is_agent_then) return graph.Ancestors(hit.key.id);
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay,
                       question.snapshot->StayAt(hit.key.id, *question.at_ns));
  return stay.has_value() ? AncestorsOf(*stay, graph) : std::vector<NodeId>();
}

absl::Status FillHit(const Hit& hit, const SearchQuestion& question, const GraphView& graph,
                     NodeFiller* filler, v1::SearchHit* out) {
  DSG_RETURN_IF_ERROR(
      filler->Fill(*graph.FindNode(hit.key.id), hit.map_T_agent, out->mutable_node()));
  if (hit.is_in_gap) out->mutable_node()->clear_map_t_node();
  if (question.near_map.has_value()) out->set_distance_m(hit.key.distance_m);
  DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> ancestors, AncestorsOf(hit, question, graph));
  for (const NodeId ancestor : ancestors) out->add_ancestor_ids(ToString(ancestor));
  for (const NodeId related : hit.related) out->add_related_ids(ToString(related));
  return absl::OkStatus();
}

void FillPlan(const std::vector<PlanStep>& steps, v1::SearchNodesResponse* reply) {
  for (const PlanStep& step : steps) {
    v1::SearchStep* out = reply->add_plan();
    out->set_operation(step.operation);
    out->set_detail(step.detail);
    out->set_in_count(step.in_count);
    out->set_out_count(step.out_count);
  }
}

}  // namespace

absl::Status SearchNodes(Engine* engine, const CallContext& call,
                         const v1::SearchNodesRequest& request, v1::SearchNodesResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("SearchNodes", request));
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const NodePattern pattern, ReadPattern(request));
  DSG_ASSIGN_OR_RETURN(SearchQuestion question, ReadSearchQuestion(page, request));
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(const auto graph, page.view.Graph(stop));
  const Snapshot& snapshot = page.view.snapshot();
  DSG_ASSIGN_OR_RETURN(question.pattern, ResolvePattern(pattern, *graph, &snapshot, stop));
  const bool is_in_space = question.near_map.has_value() || question.box_map.has_value();
  if (is_in_space && question.pattern.compiled().asks_for_agents && !question.at_ns.has_value()) {
    return FieldError("at_ns", "", "agents move; say at which instant they are to be there");
  }
  question.snapshot = &snapshot;
  question.locate = [&](NodeId agent) { return LocateAt(snapshot, agent, *question.at_ns); };
  DSG_ASSIGN_OR_RETURN(const SearchAnswer answer, RunSearch(*graph, question, stop));

  page.view.FillHeader(reply->mutable_header());
  if (request.count_only()) reply->set_hit_count(answer.hit_count);
  NodeFiller filler(snapshot, *graph, request.view());
  std::vector<NodeId> ids;
  for (const Hit& hit : answer.hits) ids.push_back(hit.key.id);
  filler.Expect(std::move(ids));
  size_t bytes = 0;
  for (size_t i = 0; i < answer.hits.size(); ++i) {
    DSG_RETURN_IF_ERROR(call.Check());
    v1::SearchHit* out = reply->add_hits();
    DSG_RETURN_IF_ERROR(FillHit(answer.hits[i], question, *graph, &filler, out));
    bytes += out->ByteSizeLong();
    const bool is_last = i + 1 == answer.hits.size();
    if ((is_last && answer.has_more) || (!is_last && bytes > kPageBytesSoftMax)) {
      reply->set_next_page_token(page.NextToken(HitPosition(answer.hits[i].key)));
      break;
    }
  }
  FillPlan(answer.steps, reply);
  reply->set_canonical_query(FormatQuery(question.pattern.source()));
  return absl::OkStatus();
}

}  // namespace dsg::query
