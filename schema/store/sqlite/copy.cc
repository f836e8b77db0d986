// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/copy.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/page_checksum.h"
#include "schema/store/sqlite/space.h"
#include "schema/store/sqlite/verify.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

absl::Status PathTaken(const std::string& path) {
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("cannot write a copy to ", path, ": it exists; name another file, or remove it"),
      {{"field", "path"}, {"value", path}});
}

// A copy that is being made, and removed unless it gets its name.
class PartialFile {
 public:
  explicit PartialFile(std::string path) : path_(std::move(path)) { Remove(); }
  ~PartialFile() {
    if (!path_.empty()) Remove();
  }
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::string& path() const { return path_; }

  absl::Status Name(const std::string& path) {
    if (renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) != 0) {
      if (errno == EEXIST) return PathTaken(path);
      return absl::InternalError(absl::StrCat("cannot name ", path, ": ", std::strerror(errno)));
    }
    path_.clear();
    return SyncFolder(fs::path(path).parent_path().string());
  }

 private:
  void Remove() const {
    std::error_code error;
    for (const char* suffix : {"", "-journal"}) fs::remove(path_ + suffix, error);
  }

  std::string path_;
};

absl::Status WriteCopy(Database& db, const std::string& path, const StopCheck& stop,
                       const Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const int64_t page_count, db.QueryInt("PRAGMA page_count"));
  DSG_ASSIGN_OR_RETURN(const int64_t free_count, db.QueryInt("PRAGMA freelist_count"));
  const auto bytes = static_cast<double>(std::max<int64_t>(1, page_count - free_count)) *
                     static_cast<double>(kPageBytes);
  absl::Status told;
  const StopCheck ask = [&] {
    struct stat info {};
    if (progress && stat(path.c_str(), &info) == 0) {
      progress(std::min(0.95, static_cast<double>(info.st_size) / bytes));
    }
    return told = AskStop(stop);
  };
  const Database::StopScope scope(&db, ask);
  const absl::Status copied = db.CopyInto(path);
  DSG_RETURN_IF_ERROR(told);
  return copied;
}

// What counts how often a map was copied or erased from is not its content. Of an erasure that is
// going on the rows that are left go with the copy, but no bytes of those that are gone.
absl::Status ForgetCounters(const std::string& path, const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const auto db, Database::Open(path, Database::Mode::kWrite, map));
  // One transaction, which is counted too, whether or not the generation was another.
  return InTransaction(*db, [&]() -> absl::Status {
    DSG_RETURN_IF_ERROR(Query(*db,
                              "UPDATE map SET generation = 0,"
                              " is_erasing = EXISTS (SELECT 1 FROM pending_erasure)"
                              " OR EXISTS (SELECT 1 FROM noted_erasure), incarnation = ''")
                            .Run());
    return db->SetSchemaVersion();
  });
}

absl::Status NotAMap(const std::string& file, const std::string& why) {
  return MakeError(Reason::kNotAStore, absl::StrCat(file, " cannot become a map: ", why),
                   {{"file", file}});
}

// Triggers and views would run in whoever reads the map.
absl::Status CheckNoForeignSchema(Database& db, const std::string& file) {
  DSG_ASSIGN_OR_RETURN(const int64_t foreign_count,
                       db.QueryInt("SELECT count(*) FROM sqlite_master WHERE type NOT IN"
                                   " ('table', 'index')"));
  if (foreign_count == 0) return absl::OkStatus();
  return NotAMap(file, "it has triggers or views, which no map has");
}

absl::Status CheckMapFile(const std::string& file, const std::string& name) {
  struct stat info {};
  if (lstat(file.c_str(), &info) != 0) return NotAMap(file, "there is no such file");
  if (!S_ISREG(info.st_mode) || info.st_nlink != 1) {
    return NotAMap(file, "it is not a file with one name");
  }
  // For writing, so that SQLite may undo what an installation that was killed began.
  DSG_ASSIGN_OR_RETURN(const auto db, Database::Open(file, Database::Mode::kWrite, name));
  DSG_RETURN_IF_ERROR(CheckFormat(*db));
  DSG_RETURN_IF_ERROR(CheckNoForeignSchema(*db, file));
  DSG_ASSIGN_OR_RETURN(const MapSpec spec, ReadMapSpec(*db));
  DSG_RETURN_IF_ERROR(spec.Validate());
  DSG_ASSIGN_OR_RETURN(const VerifyReport report, VerifyMap(*db, spec, {}, {}));
  if (report.problems.empty()) return absl::OkStatus();
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat(file, " cannot become map \"", name,
                                "\", it is damaged: ", report.problems.front()),
                   {{"map", name}, {"file", file}});
}

// The generation that follows that of the map which is replaced; 0 for a new one.
absl::StatusOr<int64_t> CloseOldMap(const std::string& store_folder, const std::string& name) {
  const auto db = OpenAnyFormat(store_folder, name, Database::Mode::kWrite);
  // A map that is beyond reading is one to be replaced.
  if (!db.ok()) return 0;
  const auto generation = (*db)->QueryInt("SELECT generation FROM map");
  if (!(*db)->Checkpoint(/*truncate=*/true)) {
    return MakeError(Reason::kWriterLocked,
                     absl::StrCat("map \"", name,
                                  "\" is being read, so that it cannot be replaced; stop the "
                                  "readers and try again"),
                     {{"map", name}});
  }
  return generation.ok() ? *generation + 1 : 0;
}

absl::Status PrepareMapFile(const std::string& file, const std::string& name, int64_t generation) {
  {
    DSG_ASSIGN_OR_RETURN(const auto db, Database::Open(file, Database::Mode::kWrite, name));
    DSG_RETURN_IF_ERROR(Query(*db, "UPDATE map SET name = ?1, generation = ?2, incarnation = ?3")
                            .Bind(name, generation, NewIncarnation())
                            .Run());
    DSG_RETURN_IF_ERROR(db->Execute("PRAGMA journal_mode=WAL"));
    if (!db->Checkpoint(/*truncate=*/true)) return db->Error("completing " + file);
  }
  return SyncFile(file);
}

}  // namespace

absl::Status CopyMap(Database& db, const std::string& path, const StopCheck& stop,
                     const Progress& progress) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(path, error))) return PathTaken(path);
  // SQLite follows no links, and wants one spelling of a path.
  const std::string folder =
      fs::canonical(fs::absolute(fs::path(path), error).parent_path(), error).string();
  if (error) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot write a copy to ", path, ": ", error.message()),
                     {{"field", "path"}, {"value", path}});
  }
  const std::string name = fs::path(path).filename().string();
  PartialFile partial(absl::StrCat(folder, "/", name, ".new"));
  if (progress) progress(0.0);
  DSG_RETURN_IF_ERROR(AskStop(stop));
  DSG_RETURN_IF_ERROR(WriteCopy(db, partial.path(), stop, progress));
  DSG_RETURN_IF_ERROR(ForgetCounters(partial.path(), db.map_name()));
  DSG_RETURN_IF_ERROR(SyncFile(partial.path()));
  DSG_RETURN_IF_ERROR(partial.Name(absl::StrCat(folder, "/", name)));
  if (progress) progress(1.0);
  return absl::OkStatus();
}

absl::Status InstallMapFile(const std::string& store_folder, const std::string& name,
                            const std::string& file, bool replace, const std::string& program) {
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  DSG_RETURN_IF_ERROR(CheckMapFile(file, name));
  const std::string folder = MapFolder(store_folder, name);
  const std::string path = DatabasePath(store_folder, name);
  DSG_ASSIGN_OR_RETURN(const auto lock, LockNewMap(store_folder, name, program));
  std::error_code error;
  int64_t generation = 0;
  if (fs::exists(path, error)) {
    if (!replace) {
      return MakeError(Reason::kMapExists, absl::StrCat("map \"", name, "\" exists already"),
                       {{"map", name}});
    }
    DSG_ASSIGN_OR_RETURN(generation, CloseOldMap(store_folder, name));
  }
  DSG_RETURN_IF_ERROR(PrepareMapFile(file, name, generation));
  // The new file must never meet the log of the old one, whose content has been copied back.
  for (const char* suffix : {"-wal", "-shm"}) fs::remove(path + suffix, error);
  fs::rename(file, path, error);
  if (error) {
    return absl::InternalError(
        absl::StrCat("cannot make ", file, " the file of map \"", name, "\": ", error.message()));
  }
  DSG_RETURN_IF_ERROR(SyncFolder(folder));
  return SyncFolder(store_folder);
}

}  // namespace dsg::sqlite
