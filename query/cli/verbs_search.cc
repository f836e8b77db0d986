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
#include "query/cli/graph_rows.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/picture/look.h"

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

std::vector<ListColumn> HitColumns(const v1::SearchNodesResponse& reply, const NodeNames& names,
                                   ListFormat format) {
  const bool has_distance =
      std::any_of(reply.hits().begin(), reply.hits().end(),
                  [](const v1::SearchHit& hit) { return hit.has_distance_m(); });
  const bool has_related =
      format == ListFormat::kCsv ||
      std::any_of(reply.hits().begin(), reply.hits().end(),
                  [&](const v1::SearchHit& hit) { return !RelatedText(hit, names).empty(); });
  std::vector<ListColumn> columns = NodeColumns();
  if (has_distance) {
    columns.insert(columns.begin(),
                   {.heading = "distance m", .type = CellType::kReal, .decimals = 3});
  }
  columns.push_back({"in", CellType::kNode});
  if (has_related) columns.push_back({"with"});
  return columns;
}

absl::Status AddHits(const v1::SearchNodesResponse& reply, const NodeNames& names,
                     const std::vector<ListColumn>& columns, ListWriter* list) {
  const bool has_distance = columns.front().heading == "distance m";
  const bool has_related = columns.back().heading == "with";
  return list->Add(reply, reply.hits(), [&](const v1::SearchHit& hit) {
    Row row = NodeRow(hit.node());
    if (has_distance) row.insert(row.begin(), hit.distance_m());
    row.push_back(names.Of(WhereIn(hit)));
    if (has_related) row.push_back(RelatedText(hit, names));
    return row;
  });
}

std::string HitsFooter(const v1::SearchNodesResponse& reply) {
  return absl::StrCat(Footer(reply.hits_size(), "node", reply.header().read_revision(),
                             !reply.next_page_token().empty()),
                      reply.plan().empty() ? "" : RenderPlan(reply));
}

std::vector<ListColumn> NeighborColumns() {
  return {{.heading = "", .name = "direction"},
          {"relation"},
          {"id"},
          {"kind"},
          {"name"},
          {"class"},
          {"weight", CellType::kReal, 3},
          {"held", CellType::kSpan}};
}

absl::Status AddNeighbors(const v1::GetNeighborsResponse& part, ListWriter* list) {
  return list->Add(part, part.neighbors(), [](const v1::Neighbor& neighbor) {
    const v1::Node& node = neighbor.node();
    const bool leads_away = neighbor.edge().target() == node.id();
    return Row{leads_away ? "->" : "<-",
               neighbor.edge().relation(),
               node.id(),
               node.kind(),
               node.name(),
               node.semantic_class().name(),
               neighbor.edge().weight(),
               HeldOf(neighbor.edge())};
  });
}

namespace {

// Nodes, then edges.
absl::Status WriteSubgraph(const Session& session, const v1::GetSubgraphResponse& reply,
                           std::ostream& out) {
  ListWriter nodes(session.common(), session.times(), "nodes", NodeColumns(), &out);
  DSG_RETURN_IF_ERROR(nodes.Add(reply, reply.nodes(), NodeRow));
  DSG_RETURN_IF_ERROR(nodes.End("\n"));
  ListWriter edges(session.common(), session.times(), "edges", EdgeColumns(), &out);
  DSG_RETURN_IF_ERROR(edges.Add(reply, reply.edges(), EdgeRow));
  return edges.End(
      absl::StrCat(Counted(nodes.count(), "node"), ", ",
                   Footer(edges.count(), "edge", reply.header().read_revision(), false)));
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
  request.set_view(session->ViewFor(v1::NODE_VIEW_GEOMETRY));
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
  const CommonOptions& common = session->common();
  if (verb.count && !common.json) {
    out << Footer(reply.hit_count(), "node", reply.header().read_revision(), false)
        << (reply.plan().empty() ? "" : RenderPlan(reply));
    return absl::OkStatus();
  }
  NodeNames names;
  if (!common.json && common.format != ListFormat::kJsonLines) {
    std::vector<std::string> ids;
    for (const v1::SearchHit& hit : reply.hits()) {
      ids.insert(ids.end(), hit.ancestor_ids().begin(), hit.ancestor_ids().end());
      ids.insert(ids.end(), hit.related_ids().begin(), hit.related_ids().end());
    }
    DSG_ASSIGN_OR_RETURN(names, NamesOf(session, reply.header().read_revision(), ids));
  }
  const std::vector<ListColumn> columns = HitColumns(reply, names, common.format);
  ListWriter list(common, session->times(), "hits", columns, &out);
  DSG_RETURN_IF_ERROR(AddHits(reply, names, columns, &list));
  return list.End(HitsFooter(reply));
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
  DSG_RETURN_IF_ERROR(PrintHits(session, verb, all, out));
  return WritePicture(session, verb.picture, DrawFound(request, all, verb), out);
}

// The node with lines to its neighbours, in a colour for each relation.
absl::StatusOr<AnswerPicture> DrawAround(const Session& session, const AroundVerb& verb,
                                         const v1::GetNeighborsResponse& reply) {
  // Of many neighbours only names are written, not ids.
  constexpr int kLabelledMax = 12;
  AnswerPicture picture{.title = "", .revision = reply.header().read_revision()};
  auto request = session.Begin<v1::GetNodeRequest>();
  request.mutable_read_at()->set_exact_revision(picture.revision);
  request.set_id(verb.id);
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  v1::GetNodeResponse middle;
  DSG_RETURN_IF_ERROR(session.api().GetNode(session.NewCall(), request, &middle));
  const Eigen::Vector3d from_map = PointOf(middle.node().map_t_node().position());
  picture.title = absl::StrCat("around ", FoundLabel(middle.node()), ": ",
                               Counted(reply.neighbors_size(), "edge"));
  Overlay& overlay = picture.overlay;
  // The first mark is the first to find space for its label.
  MarkNode(middle.node(), kInkRgb, FoundLabel(middle.node()), &overlay);
  std::vector<std::string> relations;
  for (const v1::Neighbor& neighbor : reply.neighbors()) {
    const std::string& relation = neighbor.edge().relation();
    const auto found = std::find(relations.begin(), relations.end(), relation);
    const uint32_t rgb = AgentColor(static_cast<size_t>(found - relations.begin()));
    if (found == relations.end()) {
      relations.push_back(relation);
      overlay.legend.push_back({relation, rgb, 5.0});
    }
    const v1::Node& node = neighbor.node();
    if (!node.has_map_t_node()) continue;
    overlay.lines.push_back({{from_map, PointOf(node.map_t_node().position())}, rgb, 5.0});
    const bool is_labelled = !node.name().empty() || reply.neighbors_size() <= kLabelledMax;
    MarkNode(node, rgb, is_labelled ? FoundLabel(node) : "", &overlay);
  }
  // A neighbour may stand at the same point, as the floor of a room.
  overlay.marks.push_back({.position_map = from_map,
                           .rgb = kInkRgb,
                           .shape = OverlayMark::Shape::kRing,
                           .radius_px = 18.0});
  // Rooms are large, and what is in them matters here.
  for (OverlayOutline& outline : overlay.outlines) outline.opacity = 0.08f;
  return picture;
}

absl::Status RunAround(Session* session, const AroundVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  const bool has_picture = !verb.picture.png.empty();
  auto request = session->Begin<v1::GetNeighborsRequest>();
  request.set_id(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_outgoing(verb.outgoing);
  request.set_incoming(verb.incoming);
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::GetNeighborsRequest::set_at_ns));
  request.set_view(session->ViewFor(has_picture ? v1::NODE_VIEW_GEOMETRY : v1::NODE_VIEW_BASIC));
  ListWriter list(session->common(), session->times(), "neighbors", NeighborColumns(), &out);
  PageEnd end;
  v1::GetNeighborsResponse kept;
  const auto take = [&](const v1::GetNeighborsResponse& page) {
    if (has_picture) kept.MergeFrom(page);
    end = PageEnd::Of(page);
    return AddNeighbors(page, &list);
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::GetNeighbors, request, session->common().limit,
                                        &v1::GetNeighborsResponse::neighbors_size, take));
  DSG_RETURN_IF_ERROR(list.End(Footer(list.count(), "edge", end.revision, end.is_cut)));
  if (!has_picture) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(AnswerPicture picture, DrawAround(*session, verb, kept));
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  return WritePicture(session, verb.picture, picture, out);
}

absl::Status RunSubgraph(Session* session, const SubgraphVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetSubgraphRequest>();
  request.set_root(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_both_directions(verb.both_directions);
  request.set_depth_max(verb.depth);
  request.set_tree_only(verb.tree_only);
  request.set_view(session->ViewFor(v1::NODE_VIEW_GEOMETRY));
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
  return WriteSubgraph(*session, all, out);
}

void AddFind(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<FindVerb>({.name = "find",
                              .what = "Nodes by class, name, colour, attribute, relation and room",
                              .example = "'laptop on (desk in (room \"office 4\"))' --near 10,10,1",
                              .takes = kQuestion | kFormat,
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
  CLI::Option* count = app->add_flag("--count", verb->count, "Only say how many nodes there are")
                           ->excludes(limit)
                           ->excludes(app->get_option("--format"));
  app->add_flag("--explain", verb->explain, "Also show the plan of the search");
  AddPicture(app, "the hits", &verb->picture);
  count->excludes(app->get_option("--png"));
}

void AddAround(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<AroundVerb>({.name = "around",
                                .what = "The edges of a node and the nodes at their other ends",
                                .example = "\"desk 10\" --relation ON",
                                .takes = kQuestion | kLimit | kFormat,
                                .run = RunAround});
  app->add_option("ID", verb->id, kNodeHelp)->required();
  app->add_option("--relation", verb->relations, "Only this relation; repeatable")
      ->allow_extra_args(false);
  app->add_flag("--out", verb->outgoing, "Only edges from the node");
  app->add_flag("--in", verb->incoming, "Only edges to the node");
  app->add_option("--at", verb->at, "Only edges that held at this TIME");
  AddPicture(app, "the edges", &verb->picture);
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
