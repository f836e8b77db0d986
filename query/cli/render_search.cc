// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_search.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/node_cells.h"
#include "query/cli/table.h"

namespace dsg::cli {
namespace {

std::string HeldText(const v1::Edge& edge, const TimeText& times) {
  return times.Span(edge.has_valid_from_ns() ? edge.valid_from_ns() : kTimeMin,
                    edge.has_valid_to_ns() ? edge.valid_to_ns() : kTimeMax);
}

// The room or whatever lies nearest above places, for people; the parent where there is none.
std::string WhereIn(const v1::SearchHit& hit) {
  for (const std::string& id : hit.ancestor_ids()) {
    if (!id.empty() && id[0] == 'R') return id;
  }
  return hit.ancestor_ids().empty() ? "" : hit.ancestor_ids(0);
}

// What satisfied the relations, but for what stands in the column before.
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
                  HeldText(neighbor.edge(), times)});
  }
  return table.Render() + Footer(reply.neighbors_size(), "edge", reply.header().read_revision(),
                                 !reply.next_page_token().empty());
}

std::string RenderSubgraph(const v1::GetSubgraphResponse& reply, const TimeText& times) {
  Table nodes(NodeColumns());
  for (const v1::Node& node : reply.nodes()) nodes.AddRow(NodeCells(node));
  Table edges({{"source"}, {"relation"}, {"target"}, {"weight", Align::kRight}, {"held"}});
  for (const v1::Edge& edge : reply.edges()) {
    edges.AddRow({edge.source(), edge.relation(), edge.target(), Fixed(edge.weight(), 3),
                  HeldText(edge, times)});
  }
  return absl::StrCat(nodes.Render(), "\n", edges.Render(), Counted(reply.nodes_size(), "node"),
                      ", ",
                      Footer(reply.edges_size(), "edge", reply.header().read_revision(), false));
}

}  // namespace dsg::cli
