// SPDX-License-Identifier: Apache-2.0
// Nodes and edges of a snapshot.
#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/snapshot.h"

namespace dsg::sqlite {
namespace {

// Rows read by one statement: short enough that no read transaction pins the write-ahead log.
constexpr int kBatchRows = 512;
// Candidates read before it is asked whether the caller has enough.
constexpr std::ptrdiff_t kCandidatesAtOnce = 64;

constexpr char kEdgesFrom[] =
    "SELECT source, relation, target, rev_from, weight, payload, checksum,"
    " (SELECT name FROM relation WHERE id = relation) FROM edge"
    " WHERE source = ?1 AND rev_from <= ?2"
    " UNION ALL SELECT source, relation, target, rev_from, weight, payload, checksum,"
    " (SELECT name FROM relation WHERE id = relation) FROM edge_history"
    " WHERE source = ?1 AND rev_from <= ?2 AND rev_to > ?2";
constexpr char kEdgesTo[] =
    "SELECT source, relation, target, rev_from, weight, payload, checksum,"
    " (SELECT name FROM relation WHERE id = relation) FROM edge"
    " WHERE target = ?1 AND rev_from <= ?2"
    " UNION ALL SELECT source, relation, target, rev_from, weight, payload, checksum,"
    " (SELECT name FROM relation WHERE id = relation) FROM edge_history"
    " WHERE target = ?1 AND rev_from <= ?2 AND rev_to > ?2";

bool EdgeMatches(const EdgeFilter& filter, const std::optional<EdgeKey>& after, const Edge& edge) {
  return (filter.relation.empty() || edge.relation == filter.relation) &&
         (filter.source.empty() || edge.source == filter.source) &&
         (filter.target.empty() || edge.target == filter.target) &&
         (!filter.at_ns.has_value() || edge.valid.Contains(*filter.at_ns)) &&
         (!after.has_value() || *after < edge.key());
}

}  // namespace

absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map) {
  Node node;
  const NodeId id = IdOf(query.Int(0));
  if (query.Int(4) != RowChecksum({query.Int(0), query.Int(1), query.Int(2)}, query.Blob(3)) ||
      !DecodeNodePayload(query.Blob(3), &node)) {
    return CorruptRow(map, "node", ToString(id));
  }
  node.id = id;
  node.revision = query.Int(1);
  node.layer = static_cast<LayerId>(query.Int(2));
  return node;
}

absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map) {
  Edge edge;
  edge.source = IdOf(query.Int(0));
  edge.target = IdOf(query.Int(2));
  edge.revision = query.Int(3);
  edge.weight = query.Real(4);
  edge.relation = relation;
  const std::string_view payload = query.Blob(5);
  const auto checksum = RowChecksum32(
      {query.Int(0), query.Int(1), query.Int(2), query.Int(3), BitsOf(edge.weight)}, payload);
  // Nearly all edges have nothing to decode.
  if (checksum != query.Int(6) || (!payload.empty() && !DecodeEdgePayload(payload, &edge))) {
    return CorruptRow(
        map, "edge",
        absl::StrCat(ToString(edge.source), " ", edge.relation, " ", ToString(edge.target)));
  }
  return edge;
}

absl::StatusOr<Node> SqliteSnapshot::GetNode(NodeId id) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT key, rev_from, layer, payload, checksum FROM node"
              " WHERE key = ?1 AND rev_from <= ?2"
              " UNION ALL SELECT key, rev_from, layer, payload, checksum FROM node_history"
              " WHERE key = ?1 AND rev_from <= ?2 AND rev_to > ?2");
  const bool found = query.Bind(KeyOf(id), revision()).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (found) return NodeFromRow(query, spec().name);
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("node ", ToString(id), " is unknown in map \"", spec().name,
                                "\" at revision ", revision()),
                   {{"map", spec().name}, {"node", ToString(id)}});
}

absl::StatusOr<std::vector<NodeId>> SqliteSnapshot::IdsNamed(const std::string& name) const {
  std::vector<NodeId> ids;
  if (name.empty()) return ids;
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  // `name <> ''` lets the partial index serve.
  Query query(*lease,
              "SELECT key FROM node WHERE name = ?1 AND name <> '' AND rev_from <= ?2"
              " UNION SELECT key FROM node_history"
              " WHERE rev_to > ?2 AND name = ?1 AND +rev_from <= ?2");
  query.Bind(name, revision());
  while (query.Next()) ids.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(ids.begin(), ids.end());
  return ids;
}

absl::StatusOr<NodeId> SqliteSnapshot::ResolveNode(std::string_view id_or_name) const {
  const auto id = ParseNodeId(id_or_name);
  if (id.ok()) {
    const auto node = GetNode(*id);
    if (node.ok()) return *id;
    if (!absl::IsNotFound(node.status())) return node.status();
  }
  DSG_ASSIGN_OR_RETURN(const auto ids, IdsNamed(std::string(id_or_name)));
  if (!ids.empty()) return ids.front();
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("no node of map \"", spec().name, "\" has the id or name \"",
                                std::string(id_or_name), "\" at revision ", revision()),
                   {{"map", spec().name}, {"node", std::string(id_or_name)}});
}

absl::StatusOr<NodeId> SqliteSnapshot::ResolveAgent(std::string_view id_or_name) const {
  const auto is_agent = [this](NodeId id) -> absl::StatusOr<bool> {
    const auto track = reader_->GetTrack(id, revision());
    if (absl::IsNotFound(track.status())) return false;
    DSG_RETURN_IF_ERROR(track.status());
    return true;
  };
  if (const auto id = ParseNodeId(id_or_name); id.ok()) {
    DSG_ASSIGN_OR_RETURN(const bool found, is_agent(*id));
    if (found) return *id;
  }
  DSG_ASSIGN_OR_RETURN(const auto named, IdsNamed(std::string(id_or_name)));
  std::vector<NodeId> agents;
  for (const NodeId id : named) {
    DSG_ASSIGN_OR_RETURN(const bool found, is_agent(id));
    if (found) agents.push_back(id);
  }
  if (agents.size() == 1) return agents.front();
  if (agents.size() > 1) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("several agents of map \"", spec().name, "\" are named \"",
                                  std::string(id_or_name), "\", ", ToString(agents[0]), " and ",
                                  ToString(agents[1]), " among them; ask by id"),
                     {{"map", spec().name}, {"agent", std::string(id_or_name)}});
  }
  return MakeError(
      Reason::kAgentUnknown,
      absl::StrCat("no human or robot of map \"", spec().name, "\" has the id or name \"",
                   std::string(id_or_name), "\" at revision ", revision(),
                   "; `dsg ls --layer agents` lists the known ones"),
      {{"map", spec().name}, {"agent", std::string(id_or_name)}});
}

absl::StatusOr<std::vector<NodeId>> SqliteSnapshot::ChildrenOf(NodeId parent) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT target FROM edge WHERE source = ?1 AND relation = (SELECT id FROM relation "
              "WHERE name = ?3) AND rev_from <= ?2"
              " UNION SELECT target FROM edge_history"
              " WHERE source = ?1 AND relation = (SELECT id FROM relation WHERE name = ?3) AND "
              "rev_from <= ?2 AND rev_to > ?2");
  query.Bind(KeyOf(parent), revision(), relations::kContains);
  std::vector<NodeId> ids;
  while (query.Next()) ids.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(ids.begin(), ids.end());
  return ids;
}

// Cells are of the head only. Reading the head in the same transaction tells whether that is still
// the revision asked for.
absl::StatusOr<std::optional<std::vector<NodeId>>> SqliteSnapshot::IdsTouching(
    const Box3d& box_map) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  DSG_ASSIGN_OR_RETURN(const int64_t head, lease->QueryInt("SELECT max(revision) FROM revision"));
  if (head != revision()) return std::optional<std::vector<NodeId>>();
  DSG_ASSIGN_OR_RETURN(std::vector<NodeId> ids, FindNear(*lease, box_map));
  std::sort(ids.begin(), ids.end());
  return std::optional<std::vector<NodeId>>(std::move(ids));
}

// The ids that an index can narrow the filter to; nullopt when only a scan will do.
absl::StatusOr<std::optional<std::vector<NodeId>>> SqliteSnapshot::Candidates(
    const NodeFilter& filter) const {
  using Ids = std::optional<std::vector<NodeId>>;
  if (!filter.parent.empty()) {
    DSG_ASSIGN_OR_RETURN(auto ids, ChildrenOf(filter.parent));
    return Ids(std::move(ids));
  }
  if (!filter.name.empty()) {
    DSG_ASSIGN_OR_RETURN(auto ids, IdsNamed(filter.name));
    return Ids(std::move(ids));
  }
  // Agents have no box in the index, so a box narrows only where a layer leaves them out.
  const bool may_be_agent = !filter.layer.has_value() || *filter.layer == layers::kAgents;
  if (filter.box_map.has_value() && !may_be_agent) return IdsTouching(*filter.box_map);
  return Ids();
}

absl::StatusOr<std::vector<Node>> SqliteSnapshot::ReadBatch(const NodeFilter& filter,
                                                            NodeId after) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  const int64_t letter = static_cast<unsigned char>(after.letter());
  const auto index = static_cast<int64_t>(after.index());
  // Two texts, so that each has the index it needs. History rows are found by rev_to: near the
  // head, where readers are, few rows end later.
  static constexpr char kAll[] =
      "SELECT key, rev_from, layer, payload, checksum, key & 255, key >> 8 FROM node"
      " WHERE (key & 255, key >> 8) > (?1, ?2) AND +rev_from <= ?3"
      " UNION ALL SELECT key, rev_from, layer, payload, checksum, key & 255, key >> 8"
      " FROM node_history INDEXED BY node_history_rev_to"
      " WHERE rev_to > ?3 AND +rev_from <= ?3 AND (key & 255, key >> 8) > (?1, ?2)"
      " ORDER BY 6, 7 LIMIT ?4";
  static constexpr char kOfLayer[] =
      "SELECT key, rev_from, layer, payload, checksum, key & 255, key >> 8 FROM node"
      " WHERE layer = ?5 AND (key & 255, key >> 8) > (?1, ?2) AND +rev_from <= ?3"
      " UNION ALL SELECT key, rev_from, layer, payload, checksum, key & 255, key >> 8"
      " FROM node_history INDEXED BY node_history_rev_to"
      " WHERE rev_to > ?3 AND +rev_from <= ?3 AND layer = ?5"
      " AND (key & 255, key >> 8) > (?1, ?2) ORDER BY 6, 7 LIMIT ?4";
  Query query(*lease, filter.layer.has_value() ? kOfLayer : kAll);
  if (filter.layer.has_value()) {
    query.Bind(letter, index, revision(), kBatchRows, *filter.layer);
  } else {
    query.Bind(letter, index, revision(), kBatchRows);
  }
  std::vector<Node> batch;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(Node node, NodeFromRow(query, spec().name));
    batch.push_back(std::move(node));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return batch;
}

absl::Status SqliteSnapshot::ScanNodes(const NodeFilter& filter, NodeId after,
                                       const StopCheck& stop,
                                       const std::function<bool(const Node&)>& visit) const {
  NodeFilter rest = filter;
  rest.parent = NodeId();
  DSG_ASSIGN_OR_RETURN(const auto candidates, Candidates(filter));
  if (candidates.has_value()) {
    auto it = std::upper_bound(candidates->begin(), candidates->end(), after);
    while (it != candidates->end()) {
      const auto end = it + std::min<std::ptrdiff_t>(kCandidatesAtOnce, candidates->end() - it);
      DSG_ASSIGN_OR_RETURN(const auto nodes, FindNodes({it, end}, stop));
      for (const std::optional<Node>& node : nodes) {
        if (node.has_value() && rest.Matches(*node) && !visit(*node)) return absl::OkStatus();
      }
      it = end;
    }
    return absl::OkStatus();
  }
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto batch, ReadBatch(rest, after));
    for (const Node& node : batch) {
      if (rest.Matches(node) && !visit(node)) return absl::OkStatus();
    }
    if (batch.size() < kBatchRows) return absl::OkStatus();
    after = batch.back().id;
  }
}

absl::StatusOr<std::vector<Edge>> SqliteSnapshot::EdgesAt(NodeId end, bool outgoing) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease, outgoing ? kEdgesFrom : kEdgesTo);
  query.Bind(KeyOf(end), revision());
  std::vector<Edge> edges;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(Edge edge, EdgeFromRow(query, query.Text(7), spec().name));
    edges.push_back(std::move(edge));
  }
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.key() < b.key(); });
  return edges;
}

absl::Status SqliteSnapshot::ScanEdges(const EdgeFilter& filter,
                                       const std::optional<EdgeKey>& after, const StopCheck& stop,
                                       const std::function<bool(const Edge&)>& visit) const {
  const auto emit = [&](NodeId end, bool outgoing) -> absl::StatusOr<bool> {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto edges, EdgesAt(end, outgoing));
    for (const Edge& edge : edges) {
      if (EdgeMatches(filter, after, edge) && !visit(edge)) return false;
    }
    return true;
  };
  if (!filter.source.empty()) return emit(filter.source, true).status();
  if (!filter.target.empty()) return emit(filter.target, false).status();
  // Nodes ascend, and so do the sources of edges. The page may begin in the middle of a source.
  NodeId before_first;
  if (after.has_value() && after->source.value > 0) {
    before_first = NodeId(after->source.value - 1);
  }
  absl::Status failure;
  DSG_RETURN_IF_ERROR(ScanNodes({}, before_first, stop, [&](const Node& node) {
    const auto go_on = emit(node.id, true);
    if (!go_on.ok()) failure = go_on.status();
    return go_on.ok() && *go_on;
  }));
  return failure;
}

absl::StatusOr<std::optional<Edge>> SqliteSnapshot::FindEdge(const EdgeKey& key) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT source, relation, target, rev_from, weight, payload, checksum, ?2 FROM edge"
              " WHERE source = ?1 AND relation = (SELECT id FROM relation WHERE name = ?2)"
              " AND target = ?3 AND rev_from <= ?4"
              " UNION ALL SELECT source, relation, target, rev_from, weight, payload, checksum, ?2"
              " FROM edge_history"
              " WHERE source = ?1 AND relation = (SELECT id FROM relation WHERE name = ?2)"
              " AND target = ?3 AND rev_from <= ?4 AND rev_to > ?4");
  const bool found =
      query.Bind(KeyOf(key.source), key.relation, KeyOf(key.target), revision()).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Edge>();
  DSG_ASSIGN_OR_RETURN(Edge edge, EdgeFromRow(query, query.Text(7), spec().name));
  return std::optional<Edge>(std::move(edge));
}

absl::StatusOr<NodeId> SqliteSnapshot::FindParent(NodeId id) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT source FROM edge WHERE target = ?1 AND relation = (SELECT id FROM relation "
              "WHERE name = ?3) AND rev_from <= ?2"
              " UNION SELECT source FROM edge_history"
              " WHERE target = ?1 AND relation = (SELECT id FROM relation WHERE name = ?3) AND "
              "rev_from <= ?2 AND rev_to > ?2");
  query.Bind(KeyOf(id), revision(), relations::kContains);
  NodeId parent;
  while (query.Next()) {
    const NodeId candidate = IdOf(query.Int(0));
    if (parent.empty() || candidate < parent) parent = candidate;
  }
  DSG_RETURN_IF_ERROR(query.status());
  return parent;
}

absl::StatusOr<std::vector<NodeId>> SqliteSnapshot::Ancestors(NodeId id) const {
  const TrackKey key{id, revision()};
  if (const auto cached = reader_->ancestors().Find(key)) return *cached;
  std::vector<NodeId> ancestors;
  // Ranks grow from child to parent, so the chain ends.
  for (NodeId at = id; !at.empty();) {
    DSG_ASSIGN_OR_RETURN(at, FindParent(at));
    if (!at.empty()) ancestors.push_back(at);
  }
  reader_->ancestors().Insert(key, std::make_shared<const std::vector<NodeId>>(ancestors),
                              64 + ancestors.size() * sizeof(NodeId));
  return ancestors;
}

}  // namespace dsg::sqlite
