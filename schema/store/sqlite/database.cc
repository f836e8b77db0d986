// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/database.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/folder_mode.h"
#include "schema/store/sqlite/page_checksum.h"

namespace dsg::sqlite {
namespace {

// mmap turns an I/O error into a signal; double-quoted strings and untrusted schemas are loose
// defaults of old times (SQLite's own advice for files that may be hostile).
void Harden(sqlite3* db) {
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DQS_DML, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DQS_DDL, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_limit(db, SQLITE_LIMIT_ATTACHED, 0);
}

constexpr char kReadPragmas[] =
    "PRAGMA busy_timeout=5000; PRAGMA mmap_size=0; PRAGMA cell_size_check=ON;"
    "PRAGMA cache_size=-16384; PRAGMA temp_store=MEMORY; PRAGMA wal_autocheckpoint=0;";
constexpr char kWritePragmas[] =
    "PRAGMA busy_timeout=5000; PRAGMA mmap_size=0; PRAGMA cell_size_check=ON;"
    "PRAGMA cache_size=-65536; PRAGMA temp_store=MEMORY; PRAGMA wal_autocheckpoint=0;"
    "PRAGMA synchronous=FULL; PRAGMA journal_size_limit=67108864; PRAGMA secure_delete=ON;";

// Of SQLite's virtual machine; some tenths of a millisecond.
constexpr int kStepsPerQuestion = 20'000;

// The first table that a statement names, for messages; nothing where there is none.
std::string TableOf(std::string_view sql) {
  for (const std::string_view before : {" FROM ", " INTO ", "UPDATE "}) {
    const size_t found = sql.find(before);
    if (found == std::string_view::npos) continue;
    const std::string_view rest = sql.substr(found + before.size());
    return absl::StrCat(", table ", std::string(rest.substr(0, rest.find_first_of(" (,;"))));
  }
  return "";
}

// The layout of a write-ahead log is SQLite's: a header of 32 bytes, then frames of 24 bytes and a
// page each. Numbers are big-endian; the magic number tells the byte order of the words that are
// summed.
constexpr size_t kLogHeaderBytes = 32;
constexpr size_t kLogFrameHeadBytes = 24;
constexpr uint32_t kLogMagic = 0x377f0682;
constexpr uint32_t kLogPageBytesMax = 65536;

uint32_t BigEndian(const char* at) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(at[i]);
  return value;
}

uint32_t LittleEndian(const char* at) {
  uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<uint8_t>(at[i]);
  return value;
}

// The running sum over all that came before, as SQLite keeps it.
class LogSum {
 public:
  explicit LogSum(bool is_big_endian) : is_big_endian_(is_big_endian) {}
  void Add(const char* bytes, size_t size) {
    for (size_t i = 0; i + 8 <= size; i += 8) {
      first_ += Word(bytes + i) + second_;
      second_ += Word(bytes + i + 4) + first_;
    }
  }
  bool Equals(const char* stored) const {
    return BigEndian(stored) == first_ && BigEndian(stored + 4) == second_;
  }

 private:
  uint32_t Word(const char* at) const { return is_big_endian_ ? BigEndian(at) : LittleEndian(at); }

  bool is_big_endian_;
  uint32_t first_ = 0;
  uint32_t second_ = 0;
};

// Number, from 1, of a bad frame that whole commits of the same log follow; 0 if there is none.
int64_t FindBadLogFrame(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kLogHeaderBytes> header{};
  if (!file.read(header.data(), kLogHeaderBytes)) return 0;
  const uint32_t magic = BigEndian(header.data());
  const uint32_t page_bytes = BigEndian(header.data() + 8);
  if ((magic & ~1u) != kLogMagic || page_bytes == 0 || page_bytes > kLogPageBytesMax) return 1;
  LogSum sum((magic & 1) != 0);
  sum.Add(header.data(), 24);
  if (!sum.Equals(header.data() + 24)) return 1;
  int64_t bad = 0;
  std::vector<char> frame(kLogFrameHeadBytes + page_bytes);
  for (int64_t number = 1; file.read(frame.data(), static_cast<std::streamsize>(frame.size()));
       ++number) {
    const bool is_of_this_log = std::equal(frame.data() + 8, frame.data() + 16, &header[16]);
    const bool is_commit = BigEndian(frame.data() + 4) != 0;
    if (bad != 0) {
      // Frames of earlier logs may stand here; they bear other salts.
      if (is_of_this_log && is_commit) return bad;
      continue;
    }
    sum.Add(frame.data(), 8);
    sum.Add(frame.data() + kLogFrameHeadBytes, page_bytes);
    if (!is_of_this_log || !sum.Equals(frame.data() + 16)) bad = number;
  }
  return 0;
}

// SQLite would let everybody read the file. Its log and index take after it. If this fails, so does
// opening it, with a reason.
void MakeFileFor(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, FileModeIn(folder));
  if (fd >= 0) close(fd);
}

int OnWalCommit(void* pages, sqlite3*, const char*, int wal_pages) {
  *static_cast<int*>(pages) = wal_pages;
  return SQLITE_OK;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::string& path, Mode mode,
                                                         const std::string& map_name) {
  std::unique_ptr<Database> made(new Database());
  made->map_name_ = map_name;
  made->path_ = path;
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_NOFOLLOW;
  if (mode == Mode::kRead) flags |= SQLITE_OPEN_READONLY;
  if (mode == Mode::kWrite) flags |= SQLITE_OPEN_READWRITE;
  if (mode == Mode::kCreate) {
    flags |= SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    MakeFileFor(path);
  }
  if (sqlite3_open_v2(path.c_str(), &made->db_, flags, SealedFilesName()) != SQLITE_OK) {
    return made->Error(absl::StrCat("opening ", path));
  }
  Harden(made->db_);
  if (mode == Mode::kCreate) {
    DSG_RETURN_IF_ERROR(made->Execute("PRAGMA page_size=4096;"));
    if (!ReservePageSeals(made->db_)) return made->Error("making room for page checksums");
    // Incremental: forgetting gives pages back without room for a second copy of the file.
    DSG_RETURN_IF_ERROR(made->Execute("PRAGMA auto_vacuum=INCREMENTAL; PRAGMA journal_mode=WAL;"));
  }
  DSG_RETURN_IF_ERROR(made->Execute(mode == Mode::kRead ? kReadPragmas : kWritePragmas));
  if (mode != Mode::kRead) sqlite3_wal_hook(made->db_, OnWalCommit, &made->wal_pages_);
  return made;
}

Database::~Database() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  sqlite3_close_v2(db_);
}

absl::Status Database::Execute(const char* sql) {
  if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) == SQLITE_OK) return absl::OkStatus();
  return Error(sql);
}

absl::StatusOr<int64_t> Database::QueryInt(const char* sql) {
  Query query(*this, sql);
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : -1;
}

bool Database::Checkpoint(bool truncate) {
  const int mode = truncate ? SQLITE_CHECKPOINT_TRUNCATE : SQLITE_CHECKPOINT_PASSIVE;
  int log_pages = 0;
  int copied_pages = 0;
  if (sqlite3_wal_checkpoint_v2(db_, nullptr, mode, &log_pages, &copied_pages) != SQLITE_OK) {
    return false;
  }
  wal_pages_ = 0;
  return log_pages == copied_pages;
}

std::optional<std::string> Database::FindLogDamage() const {
  const std::string path = path_ + "-wal";
  // A frame that was read while it was being written is whole the next time; a log that was begun
  // anew has another bad frame, or none.
  int64_t bad = FindBadLogFrame(path);
  for (int tries = 0; bad != 0 && tries < 3; ++tries) {
    bad = FindBadLogFrame(path);
  }
  if (bad == 0) return std::nullopt;
  return absl::StrCat("write-ahead log: frame ", bad,
                      " is not what was written, and the commits after it are lost");
}

absl::Status Database::WriteAnew() {
  // SQLite attaches the copy, which we allow nobody else.
  sqlite3_limit(db_, SQLITE_LIMIT_ATTACHED, 1);
  absl::Status status = Execute("PRAGMA auto_vacuum=INCREMENTAL; VACUUM");
  sqlite3_limit(db_, SQLITE_LIMIT_ATTACHED, 0);
  return status;
}

absl::Status Database::CopyInto(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const int64_t vacuum_mode, QueryInt("PRAGMA auto_vacuum"));
  // Of a database that has another mode already this one would be a change to itself.
  if (vacuum_mode == 0) DSG_RETURN_IF_ERROR(Execute("PRAGMA auto_vacuum=INCREMENTAL"));
  sqlite3_limit(db_, SQLITE_LIMIT_ATTACHED, 1);
  absl::Status status = Query(*this, "VACUUM INTO ?1").Bind(path).Run();
  sqlite3_limit(db_, SQLITE_LIMIT_ATTACHED, 0);
  return status;
}

Database::StopScope::StopScope(Database* db, const StopCheck& stop) : db_(*db) {
  if (!stop) return;
  sqlite3_progress_handler(
      db_.db_, kStepsPerQuestion,
      [](void* ask) { return (*static_cast<const StopCheck*>(ask))().ok() ? 0 : 1; },
      const_cast<StopCheck*>(&stop));
}

Database::StopScope::~StopScope() { sqlite3_progress_handler(db_.db_, 0, nullptr, nullptr); }

void Database::ReleaseMemory() { sqlite3_db_release_memory(db_); }

absl::Status Database::SetSchemaVersion() {
  const OpenTables open(this);
  return Execute("PRAGMA schema_version=1");
}

void Database::SetDefensive(bool is_defensive) {
  sqlite3_db_config(db_, SQLITE_DBCONFIG_DEFENSIVE, is_defensive ? 1 : 0, nullptr);
}

int64_t Database::changed_row_count() const { return sqlite3_changes64(db_); }

int Database::error_code() const { return sqlite3_extended_errcode(db_); }

absl::Status Database::Error(std::string_view doing) const {
  const int code = db_ == nullptr ? SQLITE_NOMEM : sqlite3_extended_errcode(db_);
  // Users know files and perhaps tables, not statements. The folder is left out: the text also goes
  // to remote callers.
  const std::string text =
      absl::StrCat("map \"", map_name_, "\" (", path_.substr(path_.rfind('/') + 1), TableOf(doing),
                   "): ", db_ == nullptr ? "out of memory" : sqlite3_errmsg(db_));
  const ErrorMetadata metadata = {
      {"map", map_name_}, {"sqlite", absl::StrCat(code)}, {"doing", std::string(doing)}};
  // A full disk also shows as an I/O error, where the shared index of the log has to grow.
  const bool is_io_error = (code & 0xff) == SQLITE_IOERR;
  const bool is_full = (code & 0xff) == SQLITE_FULL || code == SQLITE_IOERR_SHMSIZE ||
                       (is_io_error && sqlite3_system_errno(db_) == ENOSPC);
  if (is_full) {
    return MakeError(Reason::kDiskFull,
                     text + "; nothing was written, free some space and try again", metadata);
  }
  if (code == SQLITE_IOERR_DATA) {
    return MakeError(Reason::kStoreCorrupt,
                     text +
                         ": a page is not what was written; run `dsg verify` and restore from "
                         "a copy",
                     metadata);
  }
  switch (code & 0xff) {
    case SQLITE_CORRUPT:
      return MakeError(Reason::kStoreCorrupt, text + "; run `dsg verify` and restore from a copy",
                       metadata);
    case SQLITE_NOTADB:
      return MakeError(Reason::kNotAStore, text + "; the file is not a map", metadata);
    case SQLITE_CANTOPEN:
      if (sqlite3_system_errno(db_) == EMFILE || sqlite3_system_errno(db_) == ENFILE) {
        return MakeError(Reason::kOverloaded, text + "; too many files are open, raise `ulimit -n`",
                         metadata);
      }
      return MakeError(Reason::kReadOnly,
                       text +
                           "; reading needs write access to the map's folder too, for the "
                           "shared index of its log",
                       metadata);
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return MakeError(Reason::kReadOnly, text + "; check the permissions of the store", metadata);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return MakeError(Reason::kWriterLocked, text + "; try again", metadata);
    default:
      return absl::InternalError(absl::StrCat(text, ", while ", std::string(doing)));
  }
}

sqlite3_stmt* Database::Take(const char* sql, bool* owned) {
  sqlite3_stmt*& cached = statements_[sql];
  *owned = cached != nullptr && sqlite3_stmt_busy(cached) != 0;
  if (cached != nullptr && !*owned) return cached;
  sqlite3_stmt* made = nullptr;
  const unsigned flags = *owned ? 0 : SQLITE_PREPARE_PERSISTENT;
  if (sqlite3_prepare_v3(db_, sql, -1, flags, &made, nullptr) != SQLITE_OK) return nullptr;
  if (!*owned) cached = made;
  return made;
}

Query::Query(Database& db, const char* sql) : db_(db), statement_(db.Take(sql, &owned_)) {
  if (statement_ == nullptr) status_ = db_.Error(sql);
}

Query::~Query() {
  if (statement_ == nullptr) return;
  if (owned_) {
    sqlite3_finalize(statement_);
  } else {
    sqlite3_reset(statement_);
  }
}

void Query::BindOne(int index, int64_t value) {
  if (statement_ != nullptr) sqlite3_bind_int64(statement_, index, value);
}
void Query::BindOne(int index, double value) {
  if (statement_ != nullptr) sqlite3_bind_double(statement_, index, value);
}
void Query::BindOne(int index, const std::string& text) {
  if (statement_ == nullptr) return;
  sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
}
void Query::BindOne(int index, const char* text) {
  if (statement_ == nullptr) return;
  sqlite3_bind_text64(statement_, index, text, std::strlen(text), SQLITE_STATIC, SQLITE_UTF8);
}
void Query::BindOne(int index, const BlobView& blob) {
  if (statement_ == nullptr) return;
  // An empty view may have a null pointer, which SQLite would take for NULL.
  const char* data = blob.bytes.empty() ? "" : blob.bytes.data();
  sqlite3_bind_blob64(statement_, index, data, blob.bytes.size(), SQLITE_STATIC);
}
void Query::BindNull(int index) {
  if (statement_ != nullptr) sqlite3_bind_null(statement_, index);
}

bool Query::Next() {
  if (!status_.ok()) return false;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) status_ = db_.Error(sqlite3_sql(statement_));
  return false;
}

absl::Status Query::Run() {
  while (Next()) {
  }
  return status_;
}

void Query::Reset() {
  if (statement_ != nullptr) sqlite3_reset(statement_);
}

int64_t Query::Int(int column) const { return sqlite3_column_int64(statement_, column); }
double Query::Real(int column) const { return sqlite3_column_double(statement_, column); }
std::string_view Query::Text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return {text == nullptr ? "" : text,
          static_cast<size_t>(sqlite3_column_bytes(statement_, column))};
}
std::string_view Query::Blob(int column) const {
  const auto* blob = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  return {blob == nullptr ? "" : blob,
          static_cast<size_t>(sqlite3_column_bytes(statement_, column))};
}
bool Query::IsNull(int column) const {
  return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}

}  // namespace dsg::sqlite
