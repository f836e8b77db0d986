// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/asset_references.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

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
    // What a damaged row refers to would be taken for unused, and dropped.
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, db.map_name()));
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
                      absl::BytesToHexString(std::string(BytesOf(*unknown.begin()))));
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
  return Query(db, "DELETE FROM asset WHERE sha256 = ?1")
      .Bind(Query::BlobView{BytesOf(sha256)})
      .Run();
}

absl::Status DropAsset(Database& db, const StoredAsset& asset) {
  DSG_RETURN_IF_ERROR(
      Query(db, "INSERT OR IGNORE INTO dropped_asset (sha256, rev_from) VALUES (?1, ?2)")
          .Bind(Query::BlobView{BytesOf(asset.sha256)}, asset.rev_from)
          .Run());
  return DeleteAsset(db, asset.sha256);
}

absl::Status AddDoubtfulAssets(Database& db, const std::set<Sha256>& assets) {
  for (const Sha256& sha256 : assets) {
    DSG_RETURN_IF_ERROR(Query(db, "INSERT OR IGNORE INTO doubtful_asset (sha256) VALUES (?1)")
                            .Bind(Query::BlobView{BytesOf(sha256)})
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
