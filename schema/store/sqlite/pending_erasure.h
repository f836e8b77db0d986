// SPDX-License-Identifier: Apache-2.0
// What an erasure names, kept in the map from before its first commit to its last step: by then the
// rows in which it was found are gone. It is noted first; what is no longer believed of it becomes
// pending when rows are wiped. Refuses to hold anything but keys and times.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "schema/store/graph_store.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/touched_keys.h"

namespace dsg::sqlite {

struct EraseList {
  /// Nodes, edges and mesh blocks; no tracks.
  TouchedKeys keys;
  std::vector<TrackSpan> spans;
  bool assets = false;

  size_t size() const;
  /// Each thing stands once afterwards, in order, and spans of one agent do not touch.
  void Add(const EraseList& other);
};

/// In order, without relations that the map does not know: there are no edges of them.
absl::StatusOr<EraseList> ListOf(Database& db, const Erasure& erasure);

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
