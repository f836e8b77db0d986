// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/keep_sqlite.h"

#include <sqlite3.h>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::bench {
namespace {

// As our store sets them.
constexpr char kPragmas[] =
    "PRAGMA page_size=4096; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
    "PRAGMA wal_autocheckpoint=0; PRAGMA cache_size=-65536;";
// Odd, so that rows of one transaction lie on pages all over the table.
constexpr int64_t kStride = 7919;

absl::Status Execute(sqlite3* db, const std::string& sql) {
  if (sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) {
    return absl::OkStatus();
  }
  return absl::InternalError(absl::StrCat("rival: ", sql, ": ", sqlite3_errmsg(db)));
}

// Closes when it goes.
class Connection {
 public:
  ~Connection() { sqlite3_close(db_); }
  absl::Status Open(const std::string& path, int flags) {
    if (sqlite3_open_v2(path.c_str(), &db_, flags, nullptr) == SQLITE_OK) return absl::OkStatus();
    return absl::InternalError(absl::StrCat("rival: cannot open ", path));
  }
  sqlite3* get() const { return db_; }

 private:
  sqlite3* db_ = nullptr;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PlainRows>> PlainRows::Create(const std::string& folder,
                                                             int64_t row_count, int row_bytes) {
  std::unique_ptr<PlainRows> rows(new PlainRows());
  rows->row_count_ = row_count;
  const std::string path = folder + "/plain.db";
  if (sqlite3_open(path.c_str(), &rows->db_) != SQLITE_OK) {
    return absl::InternalError(absl::StrCat("rival: cannot open ", path));
  }
  DSG_RETURN_IF_ERROR(Execute(rows->db_, kPragmas));
  DSG_RETURN_IF_ERROR(
      Execute(rows->db_, "CREATE TABLE item (id INTEGER PRIMARY KEY, n INTEGER, payload BLOB)"));
  DSG_RETURN_IF_ERROR(Execute(
      rows->db_, absl::StrCat("WITH RECURSIVE c(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM c"
                              " WHERE i + 1 < ",
                              row_count, ") INSERT INTO item SELECT i, 0, randomblob(", row_bytes,
                              ") FROM c")));
  DSG_RETURN_IF_ERROR(Execute(rows->db_, "PRAGMA wal_checkpoint(TRUNCATE)"));
  const char* sql = "UPDATE item SET n = n + 1 WHERE id = ?1";
  if (sqlite3_prepare_v2(rows->db_, sql, -1, &rows->update_, nullptr) != SQLITE_OK) {
    return absl::InternalError(absl::StrCat("rival: ", sqlite3_errmsg(rows->db_)));
  }
  return rows;
}

PlainRows::~PlainRows() {
  sqlite3_finalize(update_);
  sqlite3_close(db_);
}

absl::Status PlainRows::Change(int count) {
  DSG_RETURN_IF_ERROR(Execute(db_, "BEGIN IMMEDIATE"));
  for (int i = 0; i < count; ++i) {
    next_ = (next_ + kStride) % row_count_;
    sqlite3_bind_int64(update_, 1, next_);
    const int code = sqlite3_step(update_);
    sqlite3_reset(update_);
    if (code != SQLITE_DONE) {
      return absl::InternalError(absl::StrCat("rival: ", sqlite3_errmsg(db_)));
    }
  }
  return Execute(db_, "COMMIT");
}

absl::Status CopyBySqliteBackup(const std::string& from, const std::string& to) {
  Connection source;
  DSG_RETURN_IF_ERROR(source.Open(from, SQLITE_OPEN_READONLY));
  Connection target;
  DSG_RETURN_IF_ERROR(target.Open(to, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE));
  sqlite3_backup* backup = sqlite3_backup_init(target.get(), "main", source.get(), "main");
  const int code = backup == nullptr ? SQLITE_ERROR : sqlite3_backup_step(backup, -1);
  sqlite3_backup_finish(backup);
  if (code == SQLITE_DONE) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("rival: backup: ", sqlite3_errmsg(target.get())));
}

absl::Status CopyByVacuumInto(const std::string& from, const std::string& to) {
  Connection source;
  DSG_RETURN_IF_ERROR(source.Open(from, SQLITE_OPEN_READONLY));
  return Execute(source.get(), absl::StrCat("VACUUM INTO '", to, "'"));
}

}  // namespace dsg::bench
