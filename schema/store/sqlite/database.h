// SPDX-License-Identifier: Apache-2.0
// One SQLite connection and its statements, with errors as values.
// Refuses to know what the tables mean.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/base/stop_check.h"

struct sqlite3;
struct sqlite3_stmt;

namespace dsg::sqlite {

/// Threads: one at a time.
class Database {
 public:
  enum class Mode {
    /// Reads only; never checkpoints.
    kRead,
    /// The one connection of a map that commits and checkpoints.
    kWrite,
    /// As kWrite, and makes the file.
    kCreate,
  };

  /// `map_name` is for messages. Errors: NOT_FOUND/MAP_UNKNOWN when the file is missing;
  /// FAILED_PRECONDITION/NOT_A_STORE; DATA_LOSS/STORE_CORRUPT.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path, Mode mode,
                                                        const std::string& map_name);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Runs statements that return nothing and take no values.
  absl::Status Execute(const char* sql);
  /// The first column of the first row of a pragma or query; -1 if there is none.
  absl::StatusOr<int64_t> QueryInt(const char* sql);
  /// Copies the write-ahead log into the database as far as readers allow; false if not all of it.
  /// For a map in use that is no error: the log only grows.
  bool Checkpoint(bool truncate);
  /// What damaged the write-ahead log after it was written, in a sentence; nullopt when nothing
  /// did, or when there is no log. SQLite takes the first bad frame for the torn end of a crash and
  /// forgets all that follows; but no crash leaves whole commits behind it. Safe while a writer
  /// appends.
  std::optional<std::string> FindLogDamage() const;
  /// Writes the whole file anew, so that it holds no free pages and can shrink in steps later.
  /// Needs room for a second copy while it runs.
  absl::Status WriteAnew();
  /// Writes all that is in the database now to a new file, without free pages and ready to shrink
  /// in steps. Within a StopScope it gives up when told.
  absl::Status CopyInto(const std::string& path);
  /// While it lives, statements are interrupted once `stop` says so; ask it what it said.
  class StopScope {
   public:
    /// `stop` may be empty, and must outlive this.
    StopScope(Database* db, const StopCheck& stop);
    ~StopScope();
    StopScope(const StopScope&) = delete;
    StopScope& operator=(const StopScope&) = delete;

   private:
    Database& db_;
  };
  /// While it lives, tables can be written that SQLite keeps for itself, such as the nodes of
  /// R*Trees.
  class OpenTables {
   public:
    explicit OpenTables(Database* db) : db_(*db) { db_.SetDefensive(false); }
    ~OpenTables() { db_.SetDefensive(true); }
    OpenTables(const OpenTables&) = delete;
    OpenTables& operator=(const OpenTables&) = delete;

   private:
    Database& db_;
  };
  /// Gives back the memory of pages that it keeps and does not use.
  void ReleaseMemory();
  /// Sets the counter of changes to the tables back, so that equal content is equal bytes.
  absl::Status SetSchemaVersion();
  /// Pages in the write-ahead log after the last commit.
  int wal_pages() const { return wal_pages_; }

  /// The error that the connection is in, with the map's name; what went wrong is `doing`.
  absl::Status Error(std::string_view doing) const;
  const std::string& map_name() const { return map_name_; }
  const std::string& path() const { return path_; }
  /// Rows that the last statement inserted, changed or deleted.
  int64_t changed_row_count() const;
  /// Last SQLite result code.
  int error_code() const;

 private:
  friend class Query;
  Database() = default;
  void SetDefensive(bool is_defensive);
  /// From the cache, or freshly prepared when the cached one is in use.
  sqlite3_stmt* Take(const char* sql, bool* owned);

  sqlite3* db_ = nullptr;
  std::string map_name_;
  std::string path_;
  int wal_pages_ = 0;
  /// By address: every SQL text is a literal.
  std::unordered_map<const void*, sqlite3_stmt*> statements_;
};

/// One run of a statement: bind, step, read; reset at the end, so that no read transaction
/// outlives it.
class Query {
 public:
  /// `sql` must be a literal, or live as long as the database.
  Query(Database& db, const char* sql);
  ~Query();
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  /// Binds ?1, ?2, ... in order. Text and blobs are not copied: they must outlive the query.
  template <typename... Values>
  Query& Bind(const Values&... values) {
    int index = 0;
    (BindOne(++index, values), ...);
    return *this;
  }
  /// Steps; true while there is a row. After false, ask status().
  bool Next();
  absl::Status status() const { return status_; }
  /// Steps to the end.
  absl::Status Run();
  /// Starts over with the same statement.
  void Reset();

  int64_t Int(int column) const;
  double Real(int column) const;
  std::string_view Text(int column) const;
  std::string_view Blob(int column) const;
  bool IsNull(int column) const;

  /// Marks bytes to be bound as a blob.
  struct BlobView {
    std::string_view bytes;
  };

 private:
  void BindOne(int index, int64_t value);
  void BindOne(int index, int value) { BindOne(index, static_cast<int64_t>(value)); }
  void BindOne(int index, double value);
  void BindOne(int index, const std::string& text);
  // Not by way of a string, which would be gone before the statement runs.
  void BindOne(int index, const char* text);
  void BindOne(int index, const BlobView& blob);
  void BindNull(int index);
  template <typename T>
  void BindOne(int index, const std::optional<T>& value) {
    if (value.has_value()) {
      BindOne(index, *value);
    } else {
      BindNull(index);
    }
  }

  Database& db_;
  sqlite3_stmt* statement_;
  bool owned_ = false;
  absl::Status status_;
};

/// Makes the statements of its life see one state and share the cost of opening it. Queries within
/// must end before it does.
class ReadTransaction {
 public:
  explicit ReadTransaction(Database* db) : db_(*db), status_(Query(db_, "BEGIN").Run()) {}
  ~ReadTransaction() {
    if (status_.ok()) Query(db_, "COMMIT").Run().IgnoreError();
  }
  ReadTransaction(const ReadTransaction&) = delete;
  ReadTransaction& operator=(const ReadTransaction&) = delete;

  const absl::Status& status() const { return status_; }

 private:
  Database& db_;
  absl::Status status_;
};

}  // namespace dsg::sqlite
