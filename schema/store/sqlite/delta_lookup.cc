// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/delta_lookup.h"

#include "schema/codec/payload.h"
#include "schema/store/sqlite/commit.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/sessions.h"

namespace dsg::sqlite {

absl::StatusOr<SessionState> DeltaLookup::ReadSession(const std::string& session_id) const {
  return sqlite::ReadSession(db_, session_id);
}

absl::StatusOr<std::optional<CommittedDelta>> DeltaLookup::FindCommitted(
    const std::string& session_id, int64_t sequence) const {
  return sqlite::FindCommitted(db_, session_id, sequence);
}

absl::StatusOr<std::optional<Node>> DeltaLookup::ReadNode(NodeId id) const {
  Query query(db_, "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool found = query.Bind(KeyOf(id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Node>();
  return NodeFromRow(query, db_.map_name());
}

absl::StatusOr<std::optional<Edge>> DeltaLookup::ReadEdge(const EdgeKey& key) const {
  Query query(db_,
              "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
              " WHERE source = ?1 AND target = ?2"
              " AND relation = (SELECT id FROM relation WHERE name = ?3)");
  const bool found = query.Bind(KeyOf(key.source), KeyOf(key.target), key.relation).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Edge>();
  return EdgeFromRow(query, key.relation, db_.map_name());
}

absl::StatusOr<std::vector<Layer>> DeltaLookup::ReadLayers() const {
  std::vector<Layer> layers;
  Query query(db_, "SELECT id, name, rank FROM layer");
  while (query.Next()) {
    layers.push_back({static_cast<LayerId>(query.Int(0)), std::string(query.Text(1)),
                      static_cast<int32_t>(query.Int(2))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return layers;
}

// A large delta asks for many nodes, of which only the place counts.
absl::StatusOr<std::optional<GraphLookup::NodeFacts>> DeltaLookup::FindNode(NodeId id) const {
  Query query(db_, "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool found = query.Bind(KeyOf(id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<NodeFacts>();
  Node node;
  const NodeRow row{id, query.Int(1), static_cast<LayerId>(query.Int(2)), query.Blob(3)};
  if (query.Int(4) != ChecksumOf(row) || !DecodeNodePlacement(row.payload, &node)) {
    return CorruptRow(db_.map_name(), "node", ToString(id));
  }
  return std::optional<NodeFacts>(
      NodeFacts{static_cast<LayerId>(query.Int(2)), IsAgentKind(node.kind), node.valid,
                node.box_node.isEmpty() ? Box3d() : node.BoxMap(), node.map_T_node.position,
                node.first_observed_ns, node.last_observed_ns});
}

absl::StatusOr<std::optional<Layer>> DeltaLookup::FindLayer(LayerId id) const {
  Query query(db_, "SELECT name, rank FROM layer WHERE id = ?1");
  const bool found = query.Bind(id).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Layer>();
  return std::optional<Layer>(
      Layer{id, std::string(query.Text(0)), static_cast<int32_t>(query.Int(1))});
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::ReadIds(const char* sql, NodeId id) const {
  std::vector<NodeId> ids;
  Query query(db_, sql);
  query.Bind(KeyOf(id), relations::kContains);
  while (query.Next()) ids.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  return ids;
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::FindParents(NodeId id) const {
  return ReadIds(
      "SELECT source FROM edge WHERE target = ?1 AND relation ="
      " (SELECT id FROM relation WHERE name = ?2)",
      id);
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::FindChildren(NodeId id) const {
  return ReadIds(
      "SELECT target FROM edge WHERE source = ?1 AND relation ="
      " (SELECT id FROM relation WHERE name = ?2)",
      id);
}

absl::StatusOr<std::optional<TimeNs>> DeltaLookup::FindTrackEnd(NodeId agent) const {
  Query query(db_,
              "SELECT last_ns, pose_count FROM track JOIN track_mark USING (slot)"
              " WHERE agent = ?1 ORDER BY revision DESC LIMIT 1");
  const bool found = query.Bind(KeyOf(agent)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found || query.Int(1) == 0) return std::optional<TimeNs>();
  return std::optional<TimeNs>(query.Int(0));
}

absl::StatusOr<bool> DeltaLookup::HasAsset(const Sha256& sha256) const {
  Query query(db_, "SELECT 1 FROM asset WHERE sha256 = ?1 AND part = 0");
  const bool found = query.Bind(Query::BlobView{BytesOf(sha256)}).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found;
}

absl::StatusOr<std::optional<Interval>> DeltaLookup::FindSpan() const {
  Query query(db_, "SELECT min(t0), max(t1), count(*) FROM trajectory_segment");
  query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (query.Int(2) == 0) return std::optional<Interval>();
  return std::optional<Interval>({query.Int(0), query.Int(1)});
}

}  // namespace dsg::sqlite
