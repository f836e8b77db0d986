// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/asset_references.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

std::string_view View(const Sha256& sha256) {
  return {reinterpret_cast<const char*>(sha256.data()), sha256.size()};
}

absl::StatusOr<Sha256> DigestIn(const Query& query, const std::string& map) {
  Sha256 sha256{};
  const std::string_view bytes = query.Blob(0);
  if (bytes.size() != sha256.size()) return CorruptRow(map, "asset", "0");
  std::copy(bytes.begin(), bytes.end(), sha256.begin());
  return sha256;
}

absl::Status ReadNodes(Database& db, const char* sql, std::set<Sha256>* assets) {
  Query query(db, sql);
  while (query.Next()) {
    Node node;
    // What a damaged row refers to would be taken for unused, and dropped.
    if (query.Int(4) != RowChecksum({query.Int(0), query.Int(1), query.Int(2)}, query.Blob(3)) ||
        !DecodeNodePayload(query.Blob(3), &node)) {
      return CorruptRow(db.map_name(), "node", ToString(IdOf(query.Int(0))));
    }
    CollectReferences(node, assets);
  }
  return query.status();
}

absl::Status ReadShapes(Database& db, const char* sql, std::set<Sha256>* assets) {
  Query query(db, sql);
  while (query.Next()) {
    std::optional<Sha256> topology;
    if (!DecodeShapeTopology(query.Blob(1), &topology)) {
      return CorruptRow(db.map_name(), "shape_segment", ToString(IdOf(query.Int(0))));
    }
    if (topology.has_value()) assets->insert(*topology);
  }
  return query.status();
}

}  // namespace

void CollectReferences(const Node& node, std::set<Sha256>* assets) {
  if (node.object.has_value() && node.object->model.has_value()) {
    assets->insert(*node.object->model);
  }
  if (node.agent.has_value() && node.agent->body_model.has_value()) {
    assets->insert(*node.agent->body_model);
  }
}

absl::StatusOr<std::set<Sha256>> ReadReferences(Database& db,
                                                const std::vector<StoredAsset>& stored) {
  std::set<Sha256> assets;
  for (const char* sql : {"SELECT key, rev_from, layer, payload, checksum FROM node",
                          "SELECT key, rev_from, layer, payload, checksum FROM node_history"}) {
    DSG_RETURN_IF_ERROR(ReadNodes(db, sql, &assets));
  }
  for (const char* sql : {"SELECT agent, substr(payload, 1, 64) FROM shape_segment",
                          "SELECT agent, substr(payload, 1, 64) FROM shape_history"}) {
    DSG_RETURN_IF_ERROR(ReadShapes(db, sql, &assets));
  }
  std::set<Sha256> unknown = assets;
  for (const StoredAsset& asset : stored) unknown.erase(asset.sha256);
  if (!unknown.empty()) {
    return CorruptRow(db.map_name(), "asset",
                      absl::BytesToHexString(std::string(View(*unknown.begin()))));
  }
  return assets;
}

absl::StatusOr<std::vector<StoredAsset>> ListAssets(Database& db) {
  std::vector<StoredAsset> assets;
  Query query(db, "SELECT sha256, rev_from FROM asset WHERE part = 0 ORDER BY sha256");
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const Sha256 sha256, DigestIn(query, db.map_name()));
    assets.push_back({sha256, query.Int(1)});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return assets;
}

absl::Status DeleteAsset(Database& db, const Sha256& sha256) {
  return Query(db, "DELETE FROM asset WHERE sha256 = ?1").Bind(Query::BlobView{View(sha256)}).Run();
}

absl::Status DropAsset(Database& db, const StoredAsset& asset) {
  DSG_RETURN_IF_ERROR(
      Query(db, "INSERT OR IGNORE INTO dropped_asset (sha256, rev_from) VALUES (?1, ?2)")
          .Bind(Query::BlobView{View(asset.sha256)}, asset.rev_from)
          .Run());
  return DeleteAsset(db, asset.sha256);
}

absl::Status AddDoubtfulAssets(Database& db, const std::set<Sha256>& assets) {
  for (const Sha256& sha256 : assets) {
    DSG_RETURN_IF_ERROR(Query(db, "INSERT OR IGNORE INTO doubtful_asset (sha256) VALUES (?1)")
                            .Bind(Query::BlobView{View(sha256)})
                            .Run());
  }
  return absl::OkStatus();
}

absl::StatusOr<std::set<Sha256>> ReadDoubtfulAssets(Database& db) {
  std::set<Sha256> assets;
  Query query(db, "SELECT sha256 FROM doubtful_asset");
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const Sha256 sha256, DigestIn(query, db.map_name()));
    assets.insert(sha256);
  }
  DSG_RETURN_IF_ERROR(query.status());
  return assets;
}

}  // namespace dsg::sqlite
