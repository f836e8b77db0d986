// SPDX-License-Identifier: Apache-2.0
// Wipes things out of all revisions of a map, and keeps what erasures name until it is done: an
// erasure is noted first; what is no longer believed of it becomes pending when rows are wiped.
// Refuses to touch what is believed now.
#pragma once

#include <optional>

#include "schema/store/erase_list.h"
#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// What one transaction takes out, so that its log fits into the space kept for forgetting.
struct EraseStep {
  int64_t bytes = int64_t{2} << 20;
  int64_t rows = 10'000;
};

/// The work of MapWriter::Erase but for the counting of bytes and files. Each step is a
/// transaction, after which the map is sound.
absl::Status EraseFromMap(Database& db, const MapSpec& spec, const Erasure& erasure,
                          const StopCheck& stop, const Progress& progress, EraseReport* report,
                          const EraseStep& step = {});

/// As ListOf, with the relations of the map.
absl::StatusOr<EraseList> ListIn(Database& db, const Erasure& erasure);

/// Empty if no erasure is pending.
/// Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<EraseList> ReadPendingErasure(Database& db);
/// Requires: a transaction, and a list in order. Writes nothing if it is what stands there.
absl::Status WritePendingErasure(Database& db, const EraseList& list);
absl::Status DropPendingErasure(Database& db);

/// Notes an erasure that is about to be begun, planned at `planned_at`.
/// Requires: a transaction.
absl::Status AddNotedErasure(Database& db, Revision planned_at, const EraseList& list);

/// Takes out of the noted erasures what can be wiped out now: what `named` names too, and what is
/// not believed any more as it was when it was noted. `is_rest` tells whether anything is left.
/// Requires: a transaction.
/// Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<EraseList> TakeRipeErasures(Database& db, const EraseList& named, bool* is_rest);

/// All that is noted or begun; nullopt if no erasure is.
absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure(Database& db);

}  // namespace dsg::sqlite
