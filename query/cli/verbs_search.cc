// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_search.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

// The nearest ancestor that is a room; the parent without one.
std::string WhereIn(const v1::SearchHit& hit) {
  for (const std::string& id : hit.ancestor_ids()) {
    if (!id.empty() && id[0] == 'R') return id;
  }
  return hit.ancestor_ids().empty() ? "" : hit.ancestor_ids(0);
}

// The nodes that satisfied the relations, without the one in the column before.
std::string RelatedText(const v1::SearchHit& hit, const NodeNames& names) {
  const std::string in = WhereIn(hit);
  std::vector<std::string> parts;
  for (const std::string& id : hit.related_ids()) {
    if (!id.empty() && id != in) parts.push_back(names.Text(id));
  }
  return absl::StrJoin(parts, ", ");
}

std::string RenderPlan(const v1::SearchNodesResponse& reply) {
  Table table({{"step"}, {"in", Align::kRight}, {"out", Align::kRight}, {"detail"}});
  for (const v1::SearchStep& step : reply.plan()) {
    table.AddRow({step.operation(), absl::StrCat(step.in_count()), absl::StrCat(step.out_count()),
                  step.detail()});
  }
  return absl::StrCat("\n", table.Render(), "understood as: ", Printable(reply.canonical_query()),
                      "\n");
}

}  // namespace

std::string RenderHits(const v1::SearchNodesResponse& reply, const NodeNames& names) {
  const bool has_distance =
      std::any_of(reply.hits().begin(), reply.hits().end(),
                  [](const v1::SearchHit& hit) { return hit.has_distance_m(); });
  const bool has_related =
      std::any_of(reply.hits().begin(), reply.hits().end(),
                  [&](const v1::SearchHit& hit) { return !RelatedText(hit, names).empty(); });
  std::vector<Column> columns = NodeColumns();
  if (has_distance) columns.insert(columns.begin(), {"distance m", Align::kRight});
  columns.push_back({"in"});
  if (has_related) columns.push_back({"with"});
  Table table(columns);
  for (const v1::SearchHit& hit : reply.hits()) {
    std::vector<std::string> cells = NodeCells(hit.node());
    if (has_distance) cells.insert(cells.begin(), Fixed(hit.distance_m(), 3));
    cells.push_back(names.Text(WhereIn(hit)));
    if (has_related) cells.push_back(RelatedText(hit, names));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(),
                      Footer(reply.hits_size(), "node", reply.header().read_revision(),
                             !reply.next_page_token().empty()),
                      reply.plan().empty() ? "" : RenderPlan(reply));
}

std::string RenderNeighbors(const v1::GetNeighborsResponse& reply, const TimeText& times) {
  Table table({{""},
               {"relation"},
               {"id"},
               {"kind"},
               {"name"},
               {"class"},
               {"weight", Align::kRight},
               {"held"}});
  for (const v1::Neighbor& neighbor : reply.neighbors()) {
    const v1::Node& node = neighbor.node();
    const bool leads_away = neighbor.edge().target() == node.id();
    table.AddRow({leads_away ? "->" : "<-", neighbor.edge().relation(), node.id(), node.kind(),
                  node.name(), node.semantic_class().name(), Fixed(neighbor.edge().weight(), 3),
                  times.Held(neighbor.edge())});
  }
  return table.Render() + Footer(reply.neighbors_size(), "edge", reply.header().read_revision(),
                                 !reply.next_page_token().empty());
}

namespace {

// Nodes, then edges.
std::string RenderSubgraph(const v1::GetSubgraphResponse& reply, const TimeText& times) {
  Table nodes(NodeColumns());
  for (const v1::Node& node : reply.nodes()) nodes.AddRow(NodeCells(node));
  Table edges({{"source"}, {"relation"}, {"target"}, {"weight", Align::kRight}, {"held"}});
  for (const v1::Edge& edge : reply.edges()) {
    edges.AddRow(
        {edge.source(), edge.relation(), edge.target(), Fixed(edge.weight(), 3), times.Held(edge)});
  }
  return absl::StrCat(nodes.Render(), "\n", edges.Render(), Counted(reply.nodes_size(), "node"),
                      ", ",
                      Footer(reply.edges_size(), "edge", reply.header().read_revision(), false));
}

constexpr uint32_t kFoundRgb = 0xc8321e;
constexpr uint32_t kNearRgb = 0x1f5fbf;

absl::StatusOr<v1::SearchNodesRequest> SearchRequest(Session* session, const FindVerb& verb) {
  auto request = session->Begin<v1::SearchNodesRequest>();
  request.set_query(absl::StrJoin(verb.words, " "));
  if (!verb.near.empty()) {
    DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d near, ParsePoint("--near", verb.near));
    request.mutable_near()->set_x(near.x());
    request.mutable_near()->set_y(near.y());
    request.mutable_near()->set_z(near.z());
    request.set_max_distance_m(verb.max_distance_m);
  }
  if (!verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--box", verb.box));
    ToProto(box, request.mutable_box());
  }
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::SearchNodesRequest::set_at_ns));
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  request.set_count_only(verb.count);
  request.set_explain(verb.explain);
  return request;
}

// Marks the position of a mistake in the query.
absl::Status ShowMistake(const absl::Status& status, const std::string& query) {
  if (ReasonOf(status) != Reason::kQueryMalformed) return status;
  const ErrorMetadata metadata = MetadataOf(status);
  const auto found = metadata.find("position");
  size_t position = 0;
  if (found == metadata.end() || !absl::SimpleAtoi(found->second, &position) ||
      position > query.size()) {
    return status;
  }
  // A server may draw the query below the first line; errors here have one line.
  const absl::string_view said = status.message();
  return MakeError(Reason::kQueryMalformed,
                   absl::StrCat(said.substr(0, said.find('\n')), ", here: ",
                                query.substr(0, position), " >>>", query.substr(position)),
                   metadata);
}

std::string FoundLabel(const v1::Node& node) {
  if (!node.name().empty()) return node.name();
  const std::string& class_name = node.semantic_class().name();
  return class_name.empty() ? node.id() : absl::StrCat(class_name, " ", node.id());
}

AnswerPicture DrawFound(const v1::SearchNodesRequest& request, const v1::SearchNodesResponse& reply,
                        const FindVerb& verb) {
  AnswerPicture picture{
      .title = absl::StrCat("find ", absl::StrJoin(verb.words, " "), ": ", reply.hits_size()),
      .revision = reply.header().read_revision()};
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  if (request.has_near()) {
    picture.overlay.marks.push_back({.position_map = PointOf(request.near()),
                                     .rgb = kNearRgb,
                                     .shape = OverlayMark::Shape::kCross,
                                     .label = "from here"});
  }
  for (const v1::SearchHit& hit : reply.hits()) {
    const v1::Node& node = hit.node();
    MarkNode(node, kFoundRgb, FoundLabel(node), &picture.overlay);
  }
  return picture;
}

absl::Status PrintHits(Session* session, const FindVerb& verb, const v1::SearchNodesResponse& reply,
                       std::ostream& out) {
  if (verb.count) {
    out << Footer(reply.hit_count(), "node", reply.header().read_revision(), false)
        << (reply.plan().empty() ? "" : RenderPlan(reply));
    return absl::OkStatus();
  }
  std::vector<std::string> ids;
  for (const v1::SearchHit& hit : reply.hits()) {
    ids.insert(ids.end(), hit.ancestor_ids().begin(), hit.ancestor_ids().end());
    ids.insert(ids.end(), hit.related_ids().begin(), hit.related_ids().end());
  }
  DSG_ASSIGN_OR_RETURN(const NodeNames names,
                       NamesOf(session, reply.header().read_revision(), ids));
  out << RenderHits(reply, names);
  return absl::OkStatus();
}

absl::Status RunFind(Session* session, const FindVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::SearchNodesRequest request, SearchRequest(session, verb));
  v1::SearchNodesResponse all;
  const absl::Status found = FetchPages(
      request, session->common().limit,
      [](const v1::SearchNodesResponse& page) { return page.hits_size(); },
      [&](v1::SearchNodesRequest next, v1::SearchNodesResponse* page) {
        // Only the first page has the plan.
        next.set_explain(next.explain() && next.page_token().empty());
        return session->api().SearchNodes(session->NewCall(), next, page);
      },
      &all);
  DSG_RETURN_IF_ERROR(ShowMistake(found, request.query()));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(all, out));
  } else {
    DSG_RETURN_IF_ERROR(PrintHits(session, verb, all, out));
  }
  return WritePicture(session, verb.picture, DrawFound(request, all, verb), out);
}

absl::Status RunAround(Session* session, const AroundVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetNeighborsRequest>();
  request.set_id(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_outgoing(verb.outgoing);
  request.set_incoming(verb.incoming);
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::GetNeighborsRequest::set_at_ns));
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNeighborsResponse all;
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::GetNeighbors, request,
                                         session->common().limit,
                                         &v1::GetNeighborsResponse::neighbors_size, &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderNeighbors(all, session->times());
  return absl::OkStatus();
}

absl::Status RunSubgraph(Session* session, const SubgraphVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetSubgraphRequest>();
  request.set_root(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_both_directions(verb.both_directions);
  request.set_depth_max(verb.depth);
  request.set_tree_only(verb.tree_only);
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), request.mutable_filter()));
  v1::GetSubgraphResponse all;
  const auto merge = [&](const v1::GetSubgraphResponse& message) {
    all.MergeFrom(message);
    return true;
  };
  DSG_RETURN_IF_ERROR(session->Read(&query::Api::GetSubgraph, request, merge));
  // Only the root: the filter may name a class that does not exist.
  if (all.nodes_size() <= 1) {
    DSG_RETURN_IF_ERROR(CheckWords(session, WordsOf(verb.filter)));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderSubgraph(all, session->times());
  return absl::OkStatus();
}

void AddFind(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<FindVerb>({.name = "find",
                              .what = "Nodes by class, name, colour, attribute, relation and room",
                              .example = "'laptop on (desk in (room \"office 4\"))' --near 10,10,1",
                              .run = RunFind});
  app->add_option("QUERY", verb->words,
                  "red cup on table in (room \"Dining room\"), human in (level 1), "
                  "(cup or mug) and not red; see docs/search.md")
      ->required();
  CLI::Option* near =
      app->add_option("--near", verb->near, "Sort by distance to X,Y,Z in the map frame, metres");
  app->add_option("--max-distance", verb->max_distance_m, "Largest distance to --near, metres")
      ->check(AboveZero())
      ->needs(near);
  app->add_option("--box", verb->box, "Only nodes that touch X0,Y0,Z0,X1,Y1,Z1, metres");
  app->add_option("--at", verb->at, "What held at this TIME; default now or before");
  CLI::Option* limit =
      app->add_option("-k,--limit", grammar->common()->limit, "List at most this many entries")
          ->check(WholeAboveZero());
  CLI::Option* count =
      app->add_flag("--count", verb->count, "Only say how many nodes there are")->excludes(limit);
  app->add_flag("--explain", verb->explain, "Also show the plan of the search");
  AddPicture(app, "the hits", &verb->picture);
  count->excludes(app->get_option("--png"));
}

void AddAround(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<AroundVerb>({.name = "around",
                                .what = "The edges of a node and the nodes at their other ends",
                                .example = "\"desk 10\" --relation ON",
                                .takes = kQuestion | kLimit,
                                .run = RunAround});
  app->add_option("ID", verb->id, kNodeHelp)->required();
  app->add_option("--relation", verb->relations, "Only this relation; repeatable")
      ->allow_extra_args(false);
  app->add_flag("--out", verb->outgoing, "Only edges from the node");
  app->add_flag("--in", verb->incoming, "Only edges to the node");
  app->add_option("--at", verb->at, "Only edges that held at this TIME");
}

void AddSubgraph(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<SubgraphVerb>({.name = "subgraph",
                                  .what = "A node and all that can be reached from it",
                                  .example = "\"table 2\" --relation ON --both --depth 1",
                                  .run = RunSubgraph});
  app->add_option("ID", verb->id, kNodeHelp)->required();
  app->add_option("--relation", verb->relations,
                  "Follow this relation; repeatable; default CONTAINS")
      ->allow_extra_args(false);
  app->add_flag("--both", verb->both_directions, "Also follow edges backwards");
  app->add_option("--depth", verb->depth, "Largest number of edges from the node")
      ->check(WholeAboveZero());
  app->add_flag("--tree", verb->tree_only, "Only the edges that were followed");
  AddFilter(app, &verb->filter);
}

}  // namespace

void AddSearchVerbs(Grammar* grammar) {
  AddFind(grammar);
  AddAround(grammar);
  AddSubgraph(grammar);
}

}  // namespace dsg::cli
