// SPDX-License-Identifier: Apache-2.0
// Nodes and edges of a snapshot: one, many by their keys, pages of those that a filter admits, and
// all of them. Statements are short, so that no read transaction pins the write-ahead log.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/rows.h"
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
  return filter.Matches(edge) && (!after.has_value() || *after < edge.key());
}

// Keys of one read transaction: about a millisecond, so that it does not pin the log.
constexpr size_t kBatchKeys = 256;

// Calls `find_batch` with one stretch of the keys after the other, a read transaction for each.
template <typename Key, typename FindBatch>
absl::Status FindInBatches(SqliteMapReader* reader, Revision revision, const std::vector<Key>& keys,
                           const StopCheck& stop, const FindBatch& find_batch) {
  const std::span<const Key> all(keys);
  for (size_t first = 0; first < all.size(); first += kBatchKeys) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(auto lease, reader->LeaseAt(revision));
    DSG_RETURN_IF_ERROR(
        find_batch(&*lease, all.subspan(first, std::min(kBatchKeys, all.size() - first))));
  }
  return absl::OkStatus();
}

// The number of a relation in a map; nullopt if no edge has ever been called so.
class RelationIds {
 public:
  explicit RelationIds(Database* db) : db_(*db) {}

  absl::StatusOr<std::optional<int64_t>> Find(const std::string& name) {
    const auto [known, is_new] = ids_.try_emplace(name);
    if (is_new) {
      Query query(db_, "SELECT id FROM relation WHERE name = ?1");
      if (query.Bind(name).Next()) known->second = query.Int(0);
      DSG_RETURN_IF_ERROR(query.status());
    }
    return known->second;
  }

 private:
  Database& db_;
  std::unordered_map<std::string, std::optional<int64_t>> ids_;
};

// Rows read by one statement: some milliseconds, so that no read transaction pins the log.
constexpr int kRowsAtOnce = 2048;
constexpr int64_t kLowest = std::numeric_limits<int64_t>::min();
constexpr int64_t kHighest = std::numeric_limits<int64_t>::max();

// Runs a statement again and again, each time after the last row of the time before, until it
// gives no full batch. `bind` binds where to go on; `take` takes a row and notes where it was.
// Nobody asks for the last pages of a table because they were read last, so they are not kept.
template <typename Bind, typename Take>
absl::Status RunInBatches(SqliteMapReader* reader, Revision revision, const char* sql,
                          const StopCheck& stop, const Bind& bind, const Take& take) {
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(auto lease, reader->LeaseAt(revision));
    Query query(*lease, sql);
    bind(&query);
    int row_count = 0;
    for (; query.Next(); ++row_count) DSG_RETURN_IF_ERROR(take(query));
    DSG_RETURN_IF_ERROR(query.status());
    if (row_count < kRowsAtOnce) {
      lease->ReleaseMemory();
      return absl::OkStatus();
    }
  }
}

absl::StatusOr<std::unordered_map<int64_t, std::string>> ReadRelations(SqliteMapReader* reader,
                                                                       Revision revision) {
  DSG_ASSIGN_OR_RETURN(auto lease, reader->LeaseAt(revision));
  std::unordered_map<int64_t, std::string> names;
  Query query(*lease, "SELECT id, name FROM relation");
  while (query.Next()) names[query.Int(0)] = query.Text(1);
  DSG_RETURN_IF_ERROR(query.status());
  return names;
}

}  // namespace

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
  return UnknownNode(id);
}

absl::StatusOr<std::vector<NodeId>> SqliteSnapshot::NodesNamed(const std::string& name) const {
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
    DSG_ASSIGN_OR_RETURN(auto ids, NodesNamed(filter.name));
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
  const auto read = [&]() -> absl::StatusOr<Costed<NodeIdsPtr>> {
    std::vector<NodeId> ancestors;
    // Ranks grow from child to parent, so the chain ends.
    for (NodeId at = id; !at.empty();) {
      DSG_ASSIGN_OR_RETURN(at, FindParent(at));
      if (!at.empty()) ancestors.push_back(at);
    }
    const size_t bytes = 64 + ancestors.size() * sizeof(NodeId);
    return Costed<NodeIdsPtr>{std::make_shared<const std::vector<NodeId>>(std::move(ancestors)),
                              bytes};
  };
  DSG_ASSIGN_OR_RETURN(const NodeIdsPtr ancestors,
                       reader_->ancestors().Get({id, revision()}, {}, read));
  return *ancestors;
}

// A batch shares a connection and a read transaction, which cost more than finding a row does.
absl::StatusOr<std::vector<std::optional<Node>>> SqliteSnapshot::FindNodes(
    const std::vector<NodeId>& ids, const StopCheck& stop) const {
  std::vector<std::optional<Node>> nodes;
  nodes.reserve(ids.size());
  const auto find_batch = [&](Database* db, std::span<const NodeId> batch) -> absl::Status {
    Query query(*db,
                "SELECT key, rev_from, layer, payload, checksum FROM node"
                " WHERE key = ?1 AND rev_from <= ?2"
                " UNION ALL SELECT key, rev_from, layer, payload, checksum FROM node_history"
                " WHERE key = ?1 AND rev_from <= ?2 AND rev_to > ?2");
    for (const NodeId id : batch) {
      query.Reset();
      const bool found = query.Bind(KeyOf(id), revision()).Next();
      DSG_RETURN_IF_ERROR(query.status());
      nodes.emplace_back();
      if (!found) continue;
      DSG_ASSIGN_OR_RETURN(nodes.back(), NodeFromRow(query, spec().name));
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(FindInBatches(reader_.get(), revision(), ids, stop, find_batch));
  return nodes;
}

absl::StatusOr<std::vector<std::optional<Edge>>> SqliteSnapshot::FindEdges(
    const std::vector<EdgeKey>& keys, const StopCheck& stop) const {
  std::vector<std::optional<Edge>> edges;
  edges.reserve(keys.size());
  const auto find_batch = [&](Database* db, std::span<const EdgeKey> batch) -> absl::Status {
    RelationIds relations(db);
    Query query(*db,
                "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
                " WHERE source = ?1 AND relation = ?2 AND target = ?3 AND rev_from <= ?4"
                " UNION ALL SELECT source, relation, target, rev_from, weight, payload, checksum"
                " FROM edge_history WHERE source = ?1 AND relation = ?2 AND target = ?3"
                " AND rev_from <= ?4 AND rev_to > ?4");
    for (const EdgeKey& key : batch) {
      edges.emplace_back();
      DSG_ASSIGN_OR_RETURN(const std::optional<int64_t> relation, relations.Find(key.relation));
      if (!relation.has_value()) continue;
      query.Reset();
      const bool found =
          query.Bind(KeyOf(key.source), *relation, KeyOf(key.target), revision()).Next();
      DSG_RETURN_IF_ERROR(query.status());
      if (!found) continue;
      DSG_ASSIGN_OR_RETURN(edges.back(), EdgeFromRow(query, key.relation, spec().name));
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(FindInBatches(reader_.get(), revision(), keys, stop, find_batch));
  return edges;
}

// The history comes last: a row that a commit ends after it was read here is shown again, but none
// is missed.
absl::Status SqliteSnapshot::ReadAllNodes(const StopCheck& stop,
                                          const std::function<void(const Node&)>& visit) const {
  const auto show = [&](const Query& query) -> absl::Status {
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, spec().name));
    visit(node);
    return absl::OkStatus();
  };
  int64_t after_key = kLowest;
  DSG_RETURN_IF_ERROR(RunInBatches(
      reader_.get(), revision(),
      "SELECT key, rev_from, layer, payload, checksum FROM node"
      " WHERE key > ?1 AND rev_from <= ?2 ORDER BY key LIMIT ?3",
      stop, [&](Query* query) { query->Bind(after_key, revision(), kRowsAtOnce); },
      [&](const Query& query) {
        after_key = query.Int(0);
        return show(query);
      }));
  // Few rows end later than a revision near the head.
  Revision after_end = revision();
  int64_t after_row = kHighest;
  return RunInBatches(
      reader_.get(), revision(),
      "SELECT key, rev_from, layer, payload, checksum, rev_to, rowid"
      " FROM node_history INDEXED BY node_history_rev_to"
      " WHERE (rev_to, rowid) > (?1, ?2) AND +rev_from <= ?3 ORDER BY rev_to, rowid LIMIT ?4",
      stop, [&](Query* query) { query->Bind(after_end, after_row, revision(), kRowsAtOnce); },
      [&](const Query& query) {
        after_end = query.Int(5);
        after_row = query.Int(6);
        return show(query);
      });
}

absl::Status SqliteSnapshot::ReadAllEdges(const StopCheck& stop,
                                          const std::function<void(const Edge&)>& visit) const {
  DSG_ASSIGN_OR_RETURN(const auto relations, ReadRelations(reader_.get(), revision()));
  const auto show = [&](const Query& query) -> absl::Status {
    const auto relation = relations.find(query.Int(1));
    if (relation == relations.end()) {
      // Not one that came after the names were read: its edges are of later revisions.
      return CorruptRow(spec().name, "relation", absl::StrCat(query.Int(1)));
    }
    DSG_ASSIGN_OR_RETURN(const Edge edge, EdgeFromRow(query, relation->second, spec().name));
    visit(edge);
    return absl::OkStatus();
  };
  int64_t source = kLowest;
  int64_t relation = kLowest;
  int64_t target = kLowest;
  DSG_RETURN_IF_ERROR(RunInBatches(
      reader_.get(), revision(),
      "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
      " WHERE (source, relation, target) > (?1, ?2, ?3) AND rev_from <= ?4"
      " ORDER BY source, relation, target LIMIT ?5",
      stop, [&](Query* query) { query->Bind(source, relation, target, revision(), kRowsAtOnce); },
      [&](const Query& query) {
        source = query.Int(0);
        relation = query.Int(1);
        target = query.Int(2);
        return show(query);
      }));
  Revision after_end = revision();
  int64_t after_row = kHighest;
  return RunInBatches(
      reader_.get(), revision(),
      "SELECT source, relation, target, rev_from, weight, payload, checksum, rev_to, rowid"
      " FROM edge_history INDEXED BY edge_history_rev_to"
      " WHERE (rev_to, rowid) > (?1, ?2) AND +rev_from <= ?3 ORDER BY rev_to, rowid LIMIT ?4",
      stop, [&](Query* query) { query->Bind(after_end, after_row, revision(), kRowsAtOnce); },
      [&](const Query& query) {
        after_end = query.Int(7);
        after_row = query.Int(8);
        return show(query);
      });
}

}  // namespace dsg::sqlite
