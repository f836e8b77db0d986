// SPDX-License-Identifier: Apache-2.0
// Many nodes or edges by their keys. A batch shares a connection and a read transaction, which cost
// more than finding a row does.
#include <algorithm>
#include <span>
#include <unordered_map>

#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/snapshot.h"

namespace dsg::sqlite {
namespace {

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

}  // namespace

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

}  // namespace dsg::sqlite
