// SPDX-License-Identifier: Apache-2.0
// A file becomes a map: read whole first, then put in its place by one rename.
#include <sys/stat.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/copy.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/map_reader.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

absl::Status NotAMap(const std::string& file, const std::string& why) {
  return MakeError(Reason::kNotAStore, absl::StrCat(file, " cannot become a map: ", why),
                   {{"file", file}});
}

// Triggers and views would run in whoever reads the map.
absl::Status CheckSchema(Database& db, const std::string& file) {
  DSG_ASSIGN_OR_RETURN(const int64_t foreign_count,
                       db.QueryInt("SELECT count(*) FROM sqlite_master WHERE type NOT IN"
                                   " ('table', 'index')"));
  if (foreign_count == 0) return absl::OkStatus();
  return NotAMap(file, "it has triggers or views, which no map has");
}

absl::Status CheckFile(const std::string& file, const std::string& name) {
  struct stat info {};
  if (lstat(file.c_str(), &info) != 0) return NotAMap(file, "there is no such file");
  if (!S_ISREG(info.st_mode) || info.st_nlink != 1) {
    return NotAMap(file, "it is not a file with one name");
  }
  // For writing, so that SQLite may undo what an installation that was killed began.
  DSG_ASSIGN_OR_RETURN(const auto db, Database::Open(file, Database::Mode::kWrite, name));
  DSG_RETURN_IF_ERROR(CheckFormat(*db));
  DSG_RETURN_IF_ERROR(CheckSchema(*db, file));
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

absl::Status PrepareFile(const std::string& file, const std::string& name, int64_t generation) {
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

absl::Status InstallMapFile(const std::string& store_folder, const std::string& name,
                            const std::string& file, bool replace, const std::string& program) {
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  DSG_RETURN_IF_ERROR(CheckFile(file, name));
  const std::string folder = MapFolder(store_folder, name);
  const std::string path = DatabasePath(store_folder, name);
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) {
    return absl::InternalError(absl::StrCat("cannot make ", folder, ": ", error.message()));
  }
  DSG_ASSIGN_OR_RETURN(const auto lock, WriterLock::Acquire(store_folder, name, program));
  int64_t generation = 0;
  if (fs::exists(path, error)) {
    if (!replace) {
      return MakeError(Reason::kMapExists, absl::StrCat("map \"", name, "\" exists already"),
                       {{"map", name}});
    }
    DSG_ASSIGN_OR_RETURN(generation, CloseOldMap(store_folder, name));
  }
  DSG_RETURN_IF_ERROR(PrepareFile(file, name, generation));
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
