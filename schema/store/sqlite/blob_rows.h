// SPDX-License-Identifier: Apache-2.0
// Rows of mesh blocks and assets, and which assets other rows refer to.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/model/graph_delta.h"
#include "schema/store/content_rows.h"
#include "schema/store/snapshot.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// Columns: x, y, z, rev_from, payload, checksum. Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<MeshRow> MeshRowOf(const Query& query, const std::string& map);
BlockIndex BlockIndexOf(const Query& query);

/// As of a revision; nullopt if it shows no such block.
absl::StatusOr<std::optional<MeshBlock>> FindMeshBlock(Database& db, const BlockIndex& index,
                                                       Revision revision);
/// Each block and the revision that wrote it. Order: x, y, z.
absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> ReadMeshVersions(
    Database& db, Revision revision, const StopCheck& stop);
absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks, CommitContext* commit);
absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices, CommitContext* commit);

absl::StatusOr<bool> HasAsset(Database& db, const Sha256& sha256);
/// As of a revision; nullopt if it has no such asset. Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<std::optional<Asset>> FindAsset(Database& db, const Sha256& sha256,
                                               Revision revision);
absl::StatusOr<std::optional<AssetPart>> FindAssetPart(Database& db, const Sha256& sha256,
                                                       int64_t index, Revision revision);
absl::Status WriteAssets(const std::vector<Asset>& assets, CommitContext* commit);

/// An asset, by its rows.
struct StoredAsset {
  Sha256 sha256{};
  Revision rev_from = 0;
};
absl::StatusOr<std::vector<StoredAsset>> ListAssets(Database& db);

/// Of all nodes and shapes, current and past. Reads them all.
/// Errors: DATA_LOSS/STORE_CORRUPT for one that is not among all of `stored`: the map never was
/// like that, and the asset that was meant would be taken for unused.
absl::StatusOr<std::set<Sha256>> ReadReferences(Database& db,
                                                const std::vector<StoredAsset>& stored);

absl::Status DeleteAsset(Database& db, const Sha256& sha256);
/// The same, and notes that digests go on counting it.
absl::Status DropAsset(Database& db, const StoredAsset& asset);

/// Those that were referred to by rows which an erasure took out, until it has looked for others.
absl::Status AddDoubtfulAssets(Database& db, const std::set<Sha256>& assets);
absl::StatusOr<std::set<Sha256>> ReadDoubtfulAssets(Database& db);

}  // namespace dsg::sqlite
