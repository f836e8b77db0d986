// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/blob_rows.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/erase_list.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

absl::Status EndMeshBlock(const BlockIndex& index, CommitContext* commit) {
  Query current(commit->db,
                "SELECT x, y, z, rev_from, payload, checksum FROM mesh_block"
                " WHERE x = ?1 AND y = ?2 AND z = ?3");
  const bool exists = current.Bind(index.x, index.y, index.z).Next();
  DSG_RETURN_IF_ERROR(current.status());
  if (!exists) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const MeshRow row, MeshRowOf(current, commit->spec.name));
  commit->touched.mesh_blocks.push_back(index);
  commit->head.sums.Remove(row);
  DSG_RETURN_IF_ERROR(
      Query(commit->db,
            "INSERT INTO mesh_block_history (x, y, z, rev_from, rev_to, checksum, payload)"
            " SELECT x, y, z, rev_from, ?4, checksum, payload FROM mesh_block"
            " WHERE x = ?1 AND y = ?2 AND z = ?3")
          .Bind(index.x, index.y, index.z, commit->revision())
          .Run());
  return Query(commit->db, "DELETE FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3")
      .Bind(index.x, index.y, index.z)
      .Run();
}

absl::Status WriteMeshBlock(const MeshBlock& block, CommitContext* commit) {
  const BlockIndex& index = block.index;
  const std::string payload = EncodeMeshBlock(block);
  {
    Query current(commit->db, "SELECT payload FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3");
    if (current.Bind(index.x, index.y, index.z).Next() && current.Blob(0) == payload) {
      return absl::OkStatus();
    }
    DSG_RETURN_IF_ERROR(current.status());
  }
  DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit));
  const MeshRow row{index, commit->revision(), payload};
  commit->touched.mesh_blocks.push_back(index);
  commit->head.sums.Add(row);
  return Query(commit->db,
               "INSERT INTO mesh_block (x, y, z, rev_from, checksum, payload)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
      .Bind(index.x, index.y, index.z, commit->revision(), ChecksumOf(row),
            Query::BlobView{payload})
      .Run();
}

absl::StatusOr<Sha256> DigestIn(const Query& query, const std::string& map) {
  Sha256 sha256{};
  const std::string_view bytes = query.Blob(0);
  if (bytes.size() != sha256.size()) return CorruptRow(map, "asset", "0");
  std::copy(bytes.begin(), bytes.end(), sha256.begin());
  return sha256;
}

absl::Status CollectFromNodes(Database& db, const char* sql, std::set<Sha256>* assets) {
  Query query(db, sql);
  while (query.Next()) {
    // What a damaged row refers to would be taken for unused, and dropped.
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, db.map_name()));
    for (const Sha256& asset : AssetsOf(node)) assets->insert(asset);
  }
  return query.status();
}

absl::Status CollectFromShapes(Database& db, const char* sql, std::set<Sha256>* assets) {
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

BlockIndex BlockIndexOf(const Query& query) {
  return {static_cast<int32_t>(query.Int(0)), static_cast<int32_t>(query.Int(1)),
          static_cast<int32_t>(query.Int(2))};
}

absl::StatusOr<MeshRow> MeshRowOf(const Query& query, const std::string& map) {
  const MeshRow row{BlockIndexOf(query), query.Int(3), query.Blob(4)};
  if (query.Int(5) == ChecksumOf(row)) return row;
  return CorruptRow(map, "mesh_block",
                    absl::StrCat(row.index.x, ",", row.index.y, ",", row.index.z));
}

absl::StatusOr<std::optional<MeshBlock>> FindMeshBlock(Database& db, const BlockIndex& index,
                                                       Revision revision) {
  Query query(db,
              "SELECT x, y, z, rev_from, payload, checksum FROM mesh_block"
              " WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4"
              " UNION ALL SELECT x, y, z, rev_from, payload, checksum FROM mesh_block_history"
              " WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4 AND rev_to > ?4");
  const bool found = query.Bind(index.x, index.y, index.z, revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<MeshBlock>();
  DSG_ASSIGN_OR_RETURN(const MeshRow row, MeshRowOf(query, db.map_name()));
  std::optional<MeshBlock> block(std::in_place);
  if (DecodeMeshBlock(row.payload, &*block)) return block;
  return CorruptRow(db.map_name(), "mesh_block", absl::StrCat(index.x, ",", index.y, ",", index.z));
}

absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> ReadMeshVersions(
    Database& db, Revision revision, const StopCheck& stop) {
  Query query(db,
              "SELECT x, y, z, rev_from FROM mesh_block WHERE rev_from <= ?1"
              " UNION ALL SELECT x, y, z, rev_from FROM mesh_block_history"
              " WHERE rev_from <= ?1 AND rev_to > ?1 ORDER BY 1, 2, 3");
  query.Bind(revision);
  std::vector<std::pair<BlockIndex, Revision>> blocks;
  StopCounter counter(stop, 512);
  while (query.Next()) {
    DSG_RETURN_IF_ERROR(counter.Check());
    blocks.emplace_back(BlockIndexOf(query), query.Int(3));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return blocks;
}

absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices, CommitContext* commit) {
  for (const BlockIndex& index : indices) DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit));
  return absl::OkStatus();
}

absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks, CommitContext* commit) {
  for (const MeshBlock& block : blocks) DSG_RETURN_IF_ERROR(WriteMeshBlock(block, commit));
  return absl::OkStatus();
}

absl::StatusOr<bool> HasAsset(Database& db, const Sha256& sha256) {
  Query query(db, "SELECT 1 FROM asset WHERE sha256 = ?1 AND part = 0");
  const bool found = query.Bind(Query::BlobView{BytesOf(sha256)}).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found;
}

absl::StatusOr<std::optional<Asset>> FindAsset(Database& db, const Sha256& sha256,
                                               Revision revision) {
  Query query(db,
              "SELECT media_type, payload FROM asset WHERE sha256 = ?1 AND rev_from <= ?2"
              " ORDER BY part");
  query.Bind(Query::BlobView{BytesOf(sha256)}, revision);
  std::optional<Asset> asset;
  while (query.Next()) {
    if (!asset.has_value()) asset.emplace().sha256 = sha256;
    asset->media_type = query.Text(0);
    asset->content += query.Blob(1);
  }
  DSG_RETURN_IF_ERROR(query.status());
  if (asset.has_value() && ComputeSha256(asset->content) != sha256) {
    return CorruptRow(db.map_name(), "asset", ToHex(sha256));
  }
  return asset;
}

absl::StatusOr<std::optional<AssetPart>> FindAssetPart(Database& db, const Sha256& sha256,
                                                       int64_t index, Revision revision) {
  // The length of a blob is read without the blob.
  Query query(db,
              "SELECT checksum, payload, media_type,"
              "  (SELECT count(*) FROM asset WHERE sha256 = ?1),"
              "  (SELECT sum(length(payload)) FROM asset WHERE sha256 = ?1)"
              " FROM asset WHERE sha256 = ?1 AND part = ?2 AND rev_from <= ?3");
  const bool found = query.Bind(Query::BlobView{BytesOf(sha256)}, index, revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<AssetPart>();
  std::optional<AssetPart> part(std::in_place);
  part->content = query.Blob(1);
  if (query.Int(0) != Checksum(part->content, static_cast<uint64_t>(index))) {
    return CorruptRow(db.map_name(), "asset", ToHex(sha256));
  }
  part->media_type = query.Text(2);
  part->part_count = query.Int(3);
  part->size_bytes = query.Int(4);
  return part;
}

absl::Status WriteAssets(const std::vector<Asset>& assets, CommitContext* commit) {
  for (const Asset& asset : assets) {
    const std::string_view sha256 = BytesOf(asset.sha256);
    DSG_ASSIGN_OR_RETURN(const bool is_known, HasAsset(commit->db, asset.sha256));
    if (is_known) continue;
    commit->head.sums.Add(AssetRow{commit->revision(), sha256});
    const std::string_view content = asset.content;
    // An empty asset still needs its one row.
    for (size_t part = 0; part == 0 || part * kAssetPartBytes < content.size(); ++part) {
      const std::string_view bytes = content.substr(part * kAssetPartBytes, kAssetPartBytes);
      DSG_RETURN_IF_ERROR(
          Query(commit->db,
                "INSERT INTO asset (sha256, part, rev_from, media_type, checksum, payload)"
                " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
              .Bind(Query::BlobView{sha256}, static_cast<int64_t>(part), commit->revision(),
                    asset.media_type, Checksum(bytes, part), Query::BlobView{bytes})
              .Run());
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::set<Sha256>> ReadReferences(Database& db,
                                                const std::vector<StoredAsset>& stored) {
  std::set<Sha256> assets;
  for (const char* sql : {"SELECT key, rev_from, layer, payload, checksum FROM node",
                          "SELECT key, rev_from, layer, payload, checksum FROM node_history"}) {
    DSG_RETURN_IF_ERROR(CollectFromNodes(db, sql, &assets));
  }
  for (const char* sql : {"SELECT agent, substr(payload, 1, 64) FROM shape_segment",
                          "SELECT agent, substr(payload, 1, 64) FROM shape_history"}) {
    DSG_RETURN_IF_ERROR(CollectFromShapes(db, sql, &assets));
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
