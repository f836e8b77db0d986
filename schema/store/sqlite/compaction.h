// SPDX-License-Identifier: Apache-2.0
// Drops what no readable revision shows. Refuses to touch anything that one does.
#pragma once

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// How far a compaction has got, so that it can be stopped and go on.
struct Compaction {
  Revision keep_from = 0;
  /// The table that rows are being dropped from, and up to which row.
  size_t table = 0;
  int64_t after = 0;
  CompactReport report = {};

  /// Other rows are to go than those that were looked for; what went counts on.
  void BeginAgain() { table = after = 0; }
};

/// The work of MapWriter::Compact but for its checks and for the counting of bytes. Each step is a
/// transaction, after which the map is sound and can be read.
/// Requires: `keep_from` is at most the head and not below the oldest revision.
absl::Status CompactMap(Database& db, const StopCheck& stop, const Progress& progress,
                        Compaction* work);

}  // namespace dsg::sqlite
