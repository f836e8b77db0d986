// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/delta_lookup.h"

#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

absl::StatusOr<std::optional<GraphLookup::NodeFacts>> DeltaLookup::FindNode(NodeId id) const {
  Query query(db_, "SELECT rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool found = query.Bind(KeyOf(id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<NodeFacts>();
  Node node;
  const bool sound =
      query.Int(3) == RowChecksum({KeyOf(id), query.Int(0), query.Int(1)}, query.Blob(2)) &&
      DecodeNodePayload(query.Blob(2), &node);
  if (!sound) return CorruptRow(db_.map_name(), "node", ToString(id));
  return std::optional<NodeFacts>(
      NodeFacts{static_cast<LayerId>(query.Int(1)), IsAgentKind(node.kind), node.valid,
                node.box_node.isEmpty() ? Box3d() : node.BoxMap(), node.map_T_node.position});
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
  const bool found =
      query.Bind(Query::BlobView{{reinterpret_cast<const char*>(sha256.data()), sha256.size()}})
          .Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found;
}

}  // namespace dsg::sqlite
