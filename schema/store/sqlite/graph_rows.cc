// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/graph_rows.h"

#include <algorithm>
#include <array>
#include <bit>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

// Older formats wrote some of a node in other bytes; what has not changed is no new version.
bool IsSamePayload(std::string_view stored, const std::string& payload) {
  if (stored == payload) return true;
  Node node;
  return DecodeNodePayload(stored, &node) && EncodeNodePayload(node) == payload;
}

// In the order of their rows, so that a commit writes each page once.
template <typename T, typename Key>
std::vector<const T*> InRowOrder(const std::vector<T>& items, const Key& key) {
  std::vector<const T*> sorted;
  sorted.reserve(items.size());
  for (const T& item : items) sorted.push_back(&item);
  std::sort(sorted.begin(), sorted.end(),
            [&](const T* a, const T* b) { return key(*a) < key(*b); });
  return sorted;
}

int64_t BitsOf(double value) { return std::bit_cast<int64_t>(value); }

}  // namespace

absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map) {
  const NodeRow row{IdOf(query.Int(0)), query.Int(1), static_cast<LayerId>(query.Int(2)),
                    query.Blob(3)};
  Node node;
  if (query.Int(4) != ChecksumOf(row) || !DecodeNodePayload(row.payload, &node)) {
    return CorruptRow(map, "node", ToString(row.id));
  }
  node.id = row.id;
  node.revision = row.rev_from;
  node.layer = row.layer;
  return node;
}

absl::StatusOr<EdgeRow> EdgeRowOf(const Query& query, const std::string& map) {
  const EdgeRow row{IdOf(query.Int(0)), query.Int(1),  IdOf(query.Int(2)),
                    query.Int(3),       query.Real(4), query.Blob(5)};
  if (query.Int(6) == ChecksumOf(row)) return row;
  return CorruptRow(map, "edge", absl::StrCat(ToString(row.source), " ", ToString(row.target)));
}

absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const EdgeRow row, EdgeRowOf(query, map));
  Edge edge;
  edge.source = row.source;
  edge.target = row.target;
  edge.revision = row.rev_from;
  edge.weight = row.weight;
  edge.relation = relation;
  // Nearly all edges have nothing to decode.
  if (row.payload.empty() || DecodeEdgePayload(row.payload, &edge)) return edge;
  return CorruptRow(
      map, "edge",
      absl::StrCat(ToString(edge.source), " ", edge.relation, " ", ToString(edge.target)));
}

absl::StatusOr<int64_t> FindRelation(Database& db, const std::string& name) {
  Query query(db, "SELECT id FROM relation WHERE name = ?1");
  query.Bind(name);
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : 0;
}

absl::StatusOr<int64_t> GraphRowsWriter::FindOrAddRelation(const std::string& name) {
  const auto known = relations_.find(name);
  if (known != relations_.end()) return known->second;
  DSG_ASSIGN_OR_RETURN(int64_t id, FindRelation(commit_.db, name));
  if (id == 0) {
    Query insert(commit_.db, "INSERT INTO relation (name) VALUES (?1)");
    DSG_RETURN_IF_ERROR(insert.Bind(name).Run());
    DSG_ASSIGN_OR_RETURN(id, FindRelation(commit_.db, name));
  }
  relations_[name] = id;
  return id;
}

absl::Status GraphRowsWriter::WriteLayers(const std::vector<Layer>& layers) {
  for (const Layer& layer : layers) DSG_RETURN_IF_ERROR(WriteLayer(layer));
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::WriteLabels(const std::vector<SemanticLabel>& labels) {
  for (const SemanticLabel& label : labels) DSG_RETURN_IF_ERROR(WriteLabel(label));
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::WriteNodes(const std::vector<Node>& nodes) {
  for (const Node* node : InRowOrder(nodes, [](const Node& n) { return KeyOf(n.id); })) {
    DSG_RETURN_IF_ERROR(WriteNode(*node));
  }
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::EndEdges(const std::vector<EdgeKey>& keys) {
  for (const EdgeKey& key : keys) {
    DSG_ASSIGN_OR_RETURN(const int64_t relation, FindRelation(commit_.db, key.relation));
    if (relation == 0) continue;
    DSG_RETURN_IF_ERROR(EndEdge(KeyOf(key.source), relation, KeyOf(key.target)).status());
  }
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::WriteEdges(const std::vector<Edge>& edges) {
  // Relations are numbered in the order of the delta: digests depend on it.
  for (const Edge& edge : edges) DSG_RETURN_IF_ERROR(FindOrAddRelation(edge.relation).status());
  const auto key = [](const Edge& edge) {
    return std::make_pair(KeyOf(edge.source), KeyOf(edge.target));
  };
  for (const Edge* edge : InRowOrder(edges, key)) DSG_RETURN_IF_ERROR(WriteEdge(*edge));
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::WriteLayer(const Layer& layer) {
  Query known(commit_.db, "SELECT 1 FROM layer WHERE id = ?1");
  if (known.Bind(layer.id).Next()) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(known.status());
  commit_.touched.layers_or_labels = true;
  commit_.head.sums.Add(LayerRow{layer.id, layer.rank, commit_.revision(), layer.name});
  return Query(commit_.db, "INSERT INTO layer (id, name, rank, rev_from) VALUES (?1, ?2, ?3, ?4)")
      .Bind(layer.id, layer.name, layer.rank, commit_.revision())
      .Run();
}

absl::Status GraphRowsWriter::WriteLabel(const SemanticLabel& label) {
  Query known(commit_.db, "SELECT name FROM label WHERE id = ?1 ORDER BY rev_from DESC LIMIT 1");
  if (known.Bind(label.id).Next() && known.Text(0) == label.name) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(known.status());
  commit_.touched.layers_or_labels = true;
  // Earlier names stay: a label's version is chosen by the reader's revision.
  commit_.head.sums.Add(LabelRow{label.id, commit_.revision(), label.name});
  return Query(commit_.db, "INSERT INTO label (id, rev_from, name) VALUES (?1, ?2, ?3)")
      .Bind(label.id, commit_.revision(), label.name)
      .Run();
}

absl::Status GraphRowsWriter::WriteNode(const Node& node) {
  const std::string payload = EncodeNodePayload(node);
  bool exists = false;
  {
    Query current(commit_.db, "SELECT layer, payload FROM node WHERE key = ?1");
    exists = current.Bind(KeyOf(node.id)).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (exists && current.Int(0) == node.layer && IsSamePayload(current.Blob(1), payload)) {
      return absl::OkStatus();
    }
  }
  if (exists) DSG_RETURN_IF_ERROR(EndNode(KeyOf(node.id)).status());
  DSG_RETURN_IF_ERROR(InsertNode(node, payload));
  return AddCell(commit_.db, node);
}

absl::Status GraphRowsWriter::InsertNode(const Node& node, const std::string& payload) {
  const NodeRow row{node.id, commit_.revision(), node.layer, payload, IsAgentKind(node.kind)};
  commit_.touched.nodes.push_back(node.id);
  commit_.head.sums.Add(row);
  return Query(commit_.db,
               "INSERT INTO node (key, rev_from, layer, name, payload, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
      .Bind(KeyOf(node.id), commit_.revision(), node.layer, node.name, Query::BlobView{payload},
            ChecksumOf(row))
      .Run();
}

absl::StatusOr<bool> GraphRowsWriter::EndNode(int64_t key) {
  Query current(commit_.db,
                "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool exists = current.Bind(key).Next();
  DSG_RETURN_IF_ERROR(current.status());
  if (!exists) return false;
  DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(current, commit_.spec.name));
  commit_.touched.nodes.push_back(node.id);
  commit_.head.sums.Remove(
      NodeRow{node.id, node.revision, node.layer, current.Blob(3), IsAgentKind(node.kind)});
  DSG_RETURN_IF_ERROR(RemoveCell(commit_.db, node));
  DSG_RETURN_IF_ERROR(
      Query(commit_.db,
            "INSERT INTO node_history (key, rev_from, rev_to, layer, name, payload, checksum)"
            " SELECT key, rev_from, ?2, layer, name, payload, checksum FROM node WHERE key = ?1")
          .Bind(key, commit_.revision())
          .Run());
  DSG_RETURN_IF_ERROR(Query(commit_.db, "DELETE FROM node WHERE key = ?1").Bind(key).Run());
  return true;
}

absl::Status GraphRowsWriter::EndEdgesOf(int64_t key) {
  std::vector<std::array<int64_t, 3>> ends;
  for (const char* sql : {"SELECT source, relation, target FROM edge WHERE source = ?1",
                          "SELECT source, relation, target FROM edge WHERE target = ?1"}) {
    Query query(commit_.db, sql);
    query.Bind(key);
    while (query.Next()) ends.push_back({query.Int(0), query.Int(1), query.Int(2)});
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const auto& [source, relation, target] : ends) {
    DSG_RETURN_IF_ERROR(EndEdge(source, relation, target).status());
  }
  return absl::OkStatus();
}

absl::Status GraphRowsWriter::Retire(const Retirement& item) {
  const int64_t key = KeyOf(item.id);
  if (!item.valid_to_ns.has_value()) {
    DSG_RETURN_IF_ERROR(EndNode(key).status());
    return EndEdgesOf(key);
  }
  Node node;
  {
    Query current(commit_.db,
                  "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
    const bool exists = current.Bind(key).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (!exists) return CorruptRow(commit_.spec.name, "node", ToString(item.id));
    DSG_ASSIGN_OR_RETURN(node, NodeFromRow(current, commit_.spec.name));
  }
  node.valid.to_ns = *item.valid_to_ns;
  return WriteNode(node);
}

absl::Status GraphRowsWriter::WriteEdge(const Edge& edge) {
  DSG_ASSIGN_OR_RETURN(const int64_t relation, FindOrAddRelation(edge.relation));
  const std::string payload = EncodeEdgePayload(edge);
  DSG_ASSIGN_OR_RETURN(const bool is_new, InsertEdge(edge, relation, payload));
  if (is_new) return absl::OkStatus();
  const int64_t source = KeyOf(edge.source);
  const int64_t target = KeyOf(edge.target);
  {
    Query current(commit_.db,
                  "SELECT weight, payload FROM edge"
                  " WHERE source = ?1 AND relation = ?2 AND target = ?3");
    const bool is_same = current.Bind(source, relation, target).Next() &&
                         BitsOf(current.Real(0)) == BitsOf(edge.weight) &&
                         current.Blob(1) == payload;
    DSG_RETURN_IF_ERROR(current.status());
    if (is_same) return absl::OkStatus();
  }
  DSG_RETURN_IF_ERROR(EndEdge(source, relation, target).status());
  DSG_ASSIGN_OR_RETURN(const bool is_inserted, InsertEdge(edge, relation, payload));
  if (is_inserted) return absl::OkStatus();
  return CorruptRow(commit_.spec.name, "edge",
                    absl::StrCat(ToString(edge.source), " ", ToString(edge.target)));
}

absl::StatusOr<bool> GraphRowsWriter::InsertEdge(const Edge& edge, int64_t relation,
                                                 const std::string& payload) {
  const EdgeRow row{edge.source, relation, edge.target, commit_.revision(), edge.weight, payload};
  // Most edges are new: to look first would take as long as to insert.
  DSG_RETURN_IF_ERROR(
      Query(commit_.db,
            "INSERT INTO edge (source, relation, target, rev_from, weight, payload, checksum)"
            " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7) ON CONFLICT DO NOTHING")
          .Bind(KeyOf(edge.source), relation, KeyOf(edge.target), commit_.revision(), edge.weight,
                Query::BlobView{payload}, ChecksumOf(row))
          .Run());
  if (commit_.db.changed_row_count() == 0) return false;
  commit_.touched.edges.push_back({edge.source, relation, edge.target});
  commit_.head.sums.Add(row);
  return true;
}

absl::StatusOr<bool> GraphRowsWriter::EndEdge(int64_t source, int64_t relation, int64_t target) {
  Query current(commit_.db,
                "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
                " WHERE source = ?1 AND relation = ?2 AND target = ?3");
  const bool exists = current.Bind(source, relation, target).Next();
  DSG_RETURN_IF_ERROR(current.status());
  if (!exists) return false;
  DSG_ASSIGN_OR_RETURN(const EdgeRow row, EdgeRowOf(current, commit_.spec.name));
  commit_.touched.edges.push_back({row.source, relation, row.target});
  commit_.head.sums.Remove(row);
  DSG_RETURN_IF_ERROR(
      Query(commit_.db,
            "INSERT INTO edge_history"
            " (source, relation, target, rev_from, rev_to, weight, payload, checksum)"
            " SELECT source, relation, target, rev_from, ?4, weight, payload, checksum FROM edge"
            " WHERE source = ?1 AND relation = ?2 AND target = ?3")
          .Bind(source, relation, target, commit_.revision())
          .Run());
  DSG_RETURN_IF_ERROR(
      Query(commit_.db, "DELETE FROM edge WHERE source = ?1 AND relation = ?2 AND target = ?3")
          .Bind(source, relation, target)
          .Run());
  return true;
}

}  // namespace dsg::sqlite
