// SPDX-License-Identifier: Apache-2.0
// Which assets the rows of a map refer to.
#pragma once

#include <set>

#include "schema/store/erase_list.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

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
