// SPDX-License-Identifier: Apache-2.0
// The small answers of a snapshot: layers, counts, mesh, assets, factors.
#include "schema/store/sqlite/snapshot.h"

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/track_rules.h"

namespace dsg::sqlite {

std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<SqliteMapReader> reader,
                                             std::shared_ptr<const RevisionRecord> head) {
  return std::make_shared<const SqliteSnapshot>(std::move(reader), std::move(head));
}

absl::StatusOr<std::vector<Layer>> SqliteSnapshot::Layers() const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease, "SELECT id, name, rank FROM layer WHERE rev_from <= ?1 ORDER BY rank, name");
  query.Bind(revision());
  std::vector<Layer> layers;
  while (query.Next()) {
    layers.push_back({static_cast<LayerId>(query.Int(0)), std::string(query.Text(1)),
                      static_cast<int32_t>(query.Int(2))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return layers;
}

absl::StatusOr<std::vector<SemanticLabel>> SqliteSnapshot::Labels() const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT id, name, max(rev_from) FROM label WHERE rev_from <= ?1"
              " GROUP BY id ORDER BY id");
  query.Bind(revision());
  std::vector<SemanticLabel> labels;
  while (query.Next()) {
    labels.push_back({static_cast<int32_t>(query.Int(0)), std::string(query.Text(1))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return labels;
}

absl::StatusOr<MapStats> SqliteSnapshot::Stats() const {
  DSG_ASSIGN_OR_RETURN(const auto layers, Layers());
  MapStats stats = StatsOf(*head_, layers);
  stats.bytes_on_disk = reader_->bytes_on_disk();
  return stats;
}

absl::StatusOr<std::vector<PoseFactor>> SqliteSnapshot::Factors(NodeId agent, TimeNs from_ns,
                                                                TimeNs to_ns) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT agent, rev_from, t0, t1, payload, checksum FROM factor_segment"
              " WHERE agent = ?1 AND rev_from <= ?2 AND t0 < ?4 AND t1 >= ?3"
              " UNION ALL SELECT agent, rev_from, t0, t1, payload, checksum FROM factor_history"
              " WHERE agent = ?1 AND rev_from <= ?2 AND rev_to > ?2 AND t0 < ?4 AND t1 >= ?3");
  query.Bind(KeyOf(agent), revision(), from_ns, to_ns);
  std::vector<PoseFactor> factors;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const auto row, BatchRowOf<FactorRow>(query, spec().name));
    std::vector<PoseFactor> batch;
    if (!DecodeFactors(row.payload, &batch)) {
      return CorruptRow(spec().name, "factor_segment", ToString(agent));
    }
    for (PoseFactor& factor : batch) {
      if (factor.from_ns < to_ns && factor.to_ns >= from_ns) factors.push_back(std::move(factor));
    }
  }
  DSG_RETURN_IF_ERROR(query.status());
  SortFactors(&factors);
  return factors;
}

absl::StatusOr<std::vector<BlockIndex>> SqliteSnapshot::MeshBlocks() const {
  DSG_ASSIGN_OR_RETURN(const auto versions, MeshBlockVersions(StopCheck()));
  std::vector<BlockIndex> blocks;
  blocks.reserve(versions.size());
  for (const auto& [index, written] : versions) blocks.push_back(index);
  return blocks;
}

absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> SqliteSnapshot::MeshBlockVersions(
    const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT x, y, z, rev_from FROM mesh_block WHERE rev_from <= ?1"
              " UNION ALL SELECT x, y, z, rev_from FROM mesh_block_history"
              " WHERE rev_from <= ?1 AND rev_to > ?1 ORDER BY 1, 2, 3");
  query.Bind(revision());
  std::vector<std::pair<BlockIndex, Revision>> blocks;
  StopCounter counter(stop, 512);
  while (query.Next()) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const BlockIndex index{static_cast<int32_t>(query.Int(0)), static_cast<int32_t>(query.Int(1)),
                           static_cast<int32_t>(query.Int(2))};
    blocks.emplace_back(index, query.Int(3));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return blocks;
}

absl::StatusOr<MeshBlock> SqliteSnapshot::ReadMeshBlock(BlockIndex index) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT x, y, z, rev_from, payload, checksum FROM mesh_block"
              " WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4"
              " UNION ALL SELECT x, y, z, rev_from, payload, checksum FROM mesh_block_history"
              " WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4 AND rev_to > ?4");
  const bool found = query.Bind(index.x, index.y, index.z, revision()).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return UnknownMeshBlock(index);
  DSG_ASSIGN_OR_RETURN(const MeshRow row, MeshRowOf(query, spec().name));
  MeshBlock block;
  if (DecodeMeshBlock(row.payload, &block)) return block;
  return CorruptRow(spec().name, "mesh_block", absl::StrCat(index.x, ",", index.y, ",", index.z));
}

absl::StatusOr<Asset> SqliteSnapshot::ReadAsset(const Sha256& sha256) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT media_type, payload FROM asset WHERE sha256 = ?1 AND rev_from <= ?2"
              " ORDER BY part");
  query.Bind(Query::BlobView{BytesOf(sha256)}, revision());
  Asset asset;
  asset.sha256 = sha256;
  bool found = false;
  while (query.Next()) {
    found = true;
    asset.media_type = query.Text(0);
    asset.content += query.Blob(1);
  }
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return UnknownAsset(sha256);
  if (ComputeSha256(asset.content) != sha256) {
    return CorruptRow(spec().name, "asset", ToHex(sha256));
  }
  return asset;
}

absl::StatusOr<AssetPart> SqliteSnapshot::ReadAssetPart(const Sha256& sha256, int64_t index) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  const Query::BlobView key{{reinterpret_cast<const char*>(sha256.data()), sha256.size()}};
  // The length of a blob is read without the blob.
  Query query(*lease,
              "SELECT checksum, payload, media_type,"
              "  (SELECT count(*) FROM asset WHERE sha256 = ?1),"
              "  (SELECT sum(length(payload)) FROM asset WHERE sha256 = ?1)"
              " FROM asset WHERE sha256 = ?1 AND part = ?2 AND rev_from <= ?3");
  query.Bind(key, index, revision());
  if (!query.Next()) {
    DSG_RETURN_IF_ERROR(query.status());
    return MakeError(Reason::kAssetUnknown,
                     absl::StrCat("map \"", spec().name, "\" has no asset ", ToHex(sha256),
                                  index == 0 ? "" : absl::StrCat(" with a part ", index)),
                     {{"map", spec().name}, {"asset", ToHex(sha256)}});
  }
  AssetPart part;
  part.content = query.Blob(1);
  if (query.Int(0) != Checksum(part.content, static_cast<uint64_t>(index))) {
    return CorruptRow(spec().name, "asset", ToHex(sha256));
  }
  part.media_type = query.Text(2);
  part.part_count = query.Int(3);
  part.size_bytes = query.Int(4);
  return part;
}

}  // namespace dsg::sqlite
