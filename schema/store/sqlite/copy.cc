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

}  // namespace dsg::sqlite
