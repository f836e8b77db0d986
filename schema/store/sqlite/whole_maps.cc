// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/whole_maps.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "schema/base/folder_mode.h"
#include "schema/base/log.h"
#include "schema/base/status.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/map_reader.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

constexpr char kDropped[] = ".dropped-";
constexpr char kRenaming[] = ".renaming.";
// Names the holder of a lock that is taken to end what another program began.
constexpr char kSettler[] = "rename by the next opening of the store";
// Of NewIncarnation().
constexpr size_t kNumberDigits = 32;
// The reader that looks at a map before it is dropped asks for its head only.
constexpr size_t kLookCacheBytes = size_t{1} << 20;

absl::Status ChangeError(const std::string& doing, const std::string& map, int error) {
  const std::string text = absl::StrCat("cannot ", doing, " map \"", map,
                                        "\": ", std::strerror(error), "; nothing was changed");
  if (error == EACCES || error == EPERM || error == EROFS) {
    return MakeError(Reason::kReadOnly, text + ", check the permissions of the store's folder",
                     {{"map", map}});
  }
  if (error == ENOSPC || error == EDQUOT) {
    return MakeError(Reason::kDiskFull, text + ", free some space and try again", {{"map", map}});
  }
  return absl::InternalError(text);
}

bool IsThere(const std::string& path) {
  struct stat info {};
  return lstat(path.c_str(), &info) == 0;
}

bool IsLink(const std::string& path) {
  struct stat info {};
  return lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode);
}

// The lock of a map that is there and in a folder of its own.
absl::StatusOr<std::unique_ptr<WriterLock>> LockMap(const std::string& store_folder,
                                                    const std::string& name,
                                                    const std::string& program) {
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  if (!IsThere(DatabasePath(store_folder, name))) return UnknownMapError(name, store_folder);
  for (const std::string& path :
       {MapFolder(store_folder, name), DatabasePath(store_folder, name)}) {
    if (!IsLink(path)) continue;
    return MakeError(Reason::kNotAStore,
                     absl::StrCat(path,
                                  " is a link; move what it leads to into the store, or remove "
                                  "both by hand"),
                     {{"map", name}});
  }
  DSG_ASSIGN_OR_RETURN(auto lock, WriterLock::Acquire(store_folder, name, program));
  // Another program may have dropped it just before, and a third one begun a new one.
  if (!IsThere(DatabasePath(store_folder, name))) return UnknownMapError(name, store_folder);
  return lock;
}

// A database or what SQLite keeps beside it.
bool IsDatabaseFile(absl::string_view file, absl::string_view database) {
  if (!absl::ConsumePrefix(&file, database)) return false;
  return file.empty() || file == "-wal" || file == "-shm" || file == "-journal";
}

// What a creation of a map that was killed leaves in its folder.
bool IsLeftByCreation(absl::string_view file) {
  return file == "writer.lock" || IsDatabaseFile(file, "graph.db.new");
}

// A copy that an upgrade has kept, or had begun.
bool IsCopyOfUpgrade(absl::string_view file) {
  if (!absl::ConsumePrefix(&file, "graph.db.format")) return false;
  absl::ConsumeSuffix(&file, ".new");
  return !file.empty() && file.find_first_not_of("0123456789") == absl::string_view::npos;
}

bool IsFileOfMap(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  std::error_code error;
  return entry.symlink_status(error).type() == fs::file_type::regular &&
         (name == "reserve" || IsDatabaseFile(name, "graph.db") || IsLeftByCreation(name) ||
          IsCopyOfUpgrade(name));
}

// What somebody else has put there is not ours to remove.
absl::Status CheckForOthersFiles(const std::string& store_folder, const std::string& name) {
  std::error_code error;
  const std::string folder = MapFolder(store_folder, name);
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (IsFileOfMap(*it)) continue;
    return MakeError(Reason::kNotAStore,
                     absl::StrCat("map \"", name, "\" is not dropped: ", it->path().string(),
                                  " is no file of a map; move it away first"),
                     {{"map", name}, {"file", it->path().string()}});
  }
  if (error) return ChangeError("look at the folder of", name, error.value());
  // Its files go only if the folder may be written.
  if (access(folder.c_str(), W_OK) != 0) return ChangeError("drop", name, errno);
  return absl::OkStatus();
}

int64_t BytesOfFolder(const std::string& folder) {
  int64_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    struct stat info {};
    if (lstat(it->path().c_str(), &info) == 0 && S_ISREG(info.st_mode)) bytes += info.st_size;
  }
  return bytes;
}

// The head of a map that can be read; what stands in the way of dropping it.
absl::StatusOr<std::optional<Revision>> CheckBeforeDrop(const std::string& store_folder,
                                                        const std::string& name,
                                                        const MapCondition& condition) {
  const auto reader = SqliteMapReader::Open(store_folder, name, kLookCacheBytes);
  absl::Status looked = reader.status();
  if (looked.ok()) {
    const absl::StatusOr<RevisionInfo> head = (*reader)->Head();
    if (head.ok()) {
      DSG_RETURN_IF_ERROR(condition.Check(name, (*reader)->incarnation(), head->revision));
      return std::optional<Revision>(head->revision);
    }
    looked = head.status();
  }
  // What is not ours is not to be removed by us.
  if (ReasonOf(looked) == Reason::kNotAStore) {
    return Annotate(looked, absl::StrCat("map \"", name,
                                         "\" is not dropped; remove its folder by hand if it has "
                                         "to go"));
  }
  if (condition.is_set()) {
    return Annotate(looked, absl::StrCat("map \"", name,
                                         "\" is not dropped, since it cannot be "
                                         "told whether it is what was expected"));
  }
  return std::optional<Revision>();
}

absl::Status MoveFolder(const std::string& from, const std::string& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) {
    return absl::OkStatus();
  }
  return absl::ErrnoToStatus(errno, absl::StrCat("renaming ", from, " to ", to));
}

// Takes a folder out of the store, and removes it. Returns the bytes of files that cannot be
// removed. Requires: its lock is held.
absl::StatusOr<int64_t> RemoveFolder(const std::string& store_folder, const std::string& name) {
  const std::string dropped = absl::StrCat(store_folder, "/", kDropped, NewIncarnation());
  if (std::rename(MapFolder(store_folder, name).c_str(), dropped.c_str()) != 0) {
    return ChangeError("drop", name, errno);
  }
  DSG_RETURN_IF_ERROR(SyncFolder(store_folder));
  std::error_code error;
  fs::remove_all(dropped, error);
  // Another program may open the store now, and remove them too.
  if (!error || !IsThere(dropped)) return 0;
  Log(LogLevel::kWarning, "dropped-map-left",
      {{"map", name}, {"folder", dropped}, {"error", error.message()}});
  return BytesOfFolder(dropped);
}

// Removes what stands in the way of a folder of that name, if it is nobody's.
absl::Status ClearTarget(const std::string& store_folder, const std::string& name) {
  if (IsThere(DatabasePath(store_folder, name))) return MapExistsError(name);
  const std::string folder = MapFolder(store_folder, name);
  if (!IsThere(folder)) return absl::OkStatus();
  if (IsLink(folder)) {
    return MakeError(Reason::kMapExists,
                     absl::StrCat("map \"", name, "\" does not exist, but ", folder,
                                  " is a link; remove it, or choose another name"),
                     {{"map", name}});
  }
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (IsLeftByCreation(it->path().filename().string())) continue;
    return MakeError(Reason::kMapExists,
                     absl::StrCat("map \"", name, "\" does not exist, but its folder has ",
                                  it->path().filename().string(),
                                  " in it; move that away, or choose another name"),
                     {{"map", name}});
  }
  if (error) return ChangeError("look at the folder of", name, error.value());
  const auto lock = WriterLock::Acquire(store_folder, name, kSettler);
  if (IsThere(DatabasePath(store_folder, name))) return MapExistsError(name);
  DSG_RETURN_IF_ERROR(lock.status());
  return RemoveFolder(store_folder, name).status();
}

absl::Status WriteName(Database& db, const std::string& name) {
  return Query(db, "UPDATE map SET name = ?1").Bind(name).Run();
}

std::string MarkPath(const std::string& store_folder, const std::string& from,
                     const std::string& to) {
  return absl::StrCat(store_folder, "/", kRenaming, from, ".", to);
}

absl::Status MakeMark(const std::string& store_folder, const std::string& from,
                      const std::string& to) {
  const int fd = open(MarkPath(store_folder, from, to).c_str(),
                      O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, FileModeIn(store_folder));
  if (fd < 0) return ChangeError("rename", from, errno);
  close(fd);
  return SyncFolder(store_folder);
}

void RemoveMark(const std::string& store_folder, const std::string& from, const std::string& to) {
  unlink(MarkPath(store_folder, from, to).c_str());
}

// OLD and NEW of a mark.
std::optional<std::pair<std::string, std::string>> NamesOfMark(const std::string& file) {
  if (file.rfind(kRenaming, 0) != 0) return std::nullopt;
  const std::string names = file.substr(std::string_view(kRenaming).size());
  const size_t dot = names.find('.');
  if (dot == std::string::npos) return std::nullopt;
  std::pair<std::string, std::string> pair{names.substr(0, dot), names.substr(dot + 1)};
  if (!IsValidMapName(pair.first) || !IsValidMapName(pair.second)) return std::nullopt;
  return pair;
}

bool IsNameOfDropped(const std::string& file) {
  constexpr size_t kPrefix = std::string_view(kDropped).size();
  return file.rfind(kDropped, 0) == 0 && file.size() == kPrefix + kNumberDigits &&
         file.find_first_not_of("0123456789abcdef", kPrefix) == std::string::npos;
}

// Ends a renaming, or forgets one that had not begun. True when nothing of it is left to do.
// Requires: the lock of the map is held.
bool EndLockedRenaming(const std::string& store_folder, const std::string& from,
                       const std::string& to) {
  {
    const auto db = Database::Open(DatabasePath(store_folder, from), Database::Mode::kWrite, from);
    if (!db.ok()) return false;
    const auto spec = ReadMapSpec(**db);
    if (!spec.ok()) return false;
    if (spec->name != to) return true;
    const absl::Status cleared = ClearTarget(store_folder, to);
    // Somebody has made a map of that name: this one keeps its old one.
    if (ReasonOf(cleared) == Reason::kMapExists) return WriteName(**db, from).ok();
    if (!cleared.ok()) return false;
  }
  return MoveFolder(MapFolder(store_folder, from), MapFolder(store_folder, to)).ok() &&
         SyncFolder(store_folder).ok();
}

bool EndRenaming(const std::string& store_folder, const std::string& from, const std::string& to) {
  // The folder has moved; the mark had no time to go.
  if (!IsThere(DatabasePath(store_folder, from))) return true;
  // Whoever holds it renames the map now, or has opened it under its old name.
  const auto lock = LockMap(store_folder, from, kSettler);
  if (!lock.ok()) return ReasonOf(lock.status()) == Reason::kMapUnknown;
  return EndLockedRenaming(store_folder, from, to);
}

}  // namespace

absl::StatusOr<DropReport> DropMapFiles(const std::string& store_folder, const std::string& name,
                                        const MapCondition& condition, const std::string& program) {
  DSG_ASSIGN_OR_RETURN(const auto lock,
                       LockMap(store_folder, name, absl::StrCat("drop by ", program)));
  DropReport report;
  DSG_ASSIGN_OR_RETURN(report.head, CheckBeforeDrop(store_folder, name, condition));
  DSG_RETURN_IF_ERROR(CheckForOthersFiles(store_folder, name));
  const int64_t bytes = BytesOfFolder(MapFolder(store_folder, name));
  DSG_ASSIGN_OR_RETURN(const int64_t left, RemoveFolder(store_folder, name));
  report.bytes_on_disk = bytes - left;
  return report;
}

absl::Status RenameMapFiles(const std::string& store_folder, const std::string& from,
                            const std::string& to, const std::string& program) {
  DSG_RETURN_IF_ERROR(CheckMapName(to));
  DSG_ASSIGN_OR_RETURN(const auto lock,
                       LockMap(store_folder, from, absl::StrCat("rename by ", program)));
  if (from == to) return MapExistsError(to);
  DSG_ASSIGN_OR_RETURN(auto db, OpenMapFile(store_folder, from, Database::Mode::kWrite));
  DSG_RETURN_IF_ERROR(ClearTarget(store_folder, to));
  DSG_RETURN_IF_ERROR(MakeMark(store_folder, from, to));
  const absl::Status named = WriteName(*db, to);
  // SQLite closes its log while the folder is where it was.
  db.reset();
  if (!named.ok()) {
    // It may have been written all the same.
    if (EndLockedRenaming(store_folder, from, to)) RemoveMark(store_folder, from, to);
    return named;
  }
  // From here on the map has its new name, also if this program is killed ...
  const absl::Status moved = MoveFolder(MapFolder(store_folder, from), MapFolder(store_folder, to));
  if (moved.ok()) {
    DSG_RETURN_IF_ERROR(SyncFolder(store_folder));
    RemoveMark(store_folder, from, to);
    return absl::OkStatus();
  }
  // ... unless somebody has made a map of that name in this moment.
  DSG_ASSIGN_OR_RETURN(
      db, Database::Open(DatabasePath(store_folder, from), Database::Mode::kWrite, from));
  DSG_RETURN_IF_ERROR(WriteName(*db, from));
  RemoveMark(store_folder, from, to);
  if (IsThere(MapFolder(store_folder, to))) return MapExistsError(to);
  return Annotate(moved, absl::StrCat("map \"", from, "\" keeps its name"));
}

void SettleWholeMaps(const std::string& store_folder) {
  std::vector<std::string> dropped;
  std::vector<std::pair<std::string, std::string>> renamings;
  std::error_code error;
  for (fs::directory_iterator it(store_folder, error), end; !error && it != end;
       it.increment(error)) {
    const std::string file = it->path().filename().string();
    struct stat info {};
    const bool is_folder = lstat(it->path().c_str(), &info) == 0 && S_ISDIR(info.st_mode);
    if (is_folder && IsNameOfDropped(file)) dropped.push_back(it->path().string());
    if (auto names = NamesOfMark(file)) renamings.push_back(*std::move(names));
  }
  for (const std::string& folder : dropped) fs::remove_all(folder, error);
  for (const auto& [from, to] : renamings) {
    if (EndRenaming(store_folder, from, to)) RemoveMark(store_folder, from, to);
  }
}

bool IsBeingRenamed(const std::string& store_folder, const std::string& folder_name,
                    const std::string& name) {
  return IsValidMapName(name) && IsThere(MarkPath(store_folder, folder_name, name));
}

}  // namespace dsg::sqlite
