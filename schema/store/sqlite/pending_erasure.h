// SPDX-License-Identifier: Apache-2.0
// What an erasure names, kept in the map from its first step to its last: by then the rows in which
// it was found are gone. Refuses to hold anything but keys and times.
#pragma once

#include <string>
#include <vector>

#include "schema/store/map_writer.h"
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

}  // namespace dsg::sqlite
