// SPDX-License-Identifier: Apache-2.0
// What SQLite itself takes for the same work: 500 rows changed and synced, a file copied while it
// is open, a file written anew. Refuses to know our tables.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

struct sqlite3;
struct sqlite3_stmt;

namespace dsg::bench {

/// A plain table of rows as large as a node's, changed in transactions with synchronous=FULL.
///
/// Threads: one caller at a time.
class PlainRows {
 public:
  static absl::StatusOr<std::unique_ptr<PlainRows>> Create(const std::string& folder,
                                                           int64_t row_count, int row_bytes);
  ~PlainRows();
  PlainRows(const PlainRows&) = delete;
  PlainRows& operator=(const PlainRows&) = delete;

  /// Changes `count` rows spread over the table, in one transaction.
  absl::Status Change(int count);

 private:
  PlainRows() = default;

  sqlite3* db_ = nullptr;
  sqlite3_stmt* update_ = nullptr;
  int64_t row_count_ = 0;
  int64_t next_ = 0;
};

/// Through sqlite3_backup, all pages at a time, as ".backup" of its shell does.
absl::Status CopyBySqliteBackup(const std::string& from, const std::string& to);
absl::Status CopyByVacuumInto(const std::string& from, const std::string& to);

}  // namespace dsg::bench
