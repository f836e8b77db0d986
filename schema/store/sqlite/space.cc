// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/space.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/folder_mode.h"
#include "schema/base/log.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

// A reserve is made where the disk has so many times its size left.
constexpr int kPlenty = 4;

// The write-ahead log is copied back when it has grown to 4 MiB: what is forgotten must fit into
// the space that is kept for forgetting.
constexpr int kCheckpointPages = 1024;
// Pages given back to the file system in one transaction.
constexpr char kGivePagesBack[] = "PRAGMA incremental_vacuum(512)";

// Nodes looked at in one transaction.
constexpr int kBoxNodesPerStep = 500;

struct BoxTable {
  const char* select;
  const char* update;
  /// Of an entry: a 64-bit id and two 32-bit numbers an axis.
  size_t entry_bytes;
};

constexpr BoxTable kBoxTables[] = {
    {"SELECT nodeno, data FROM segment_box_node WHERE nodeno > ?1 ORDER BY nodeno LIMIT ?2",
     "UPDATE segment_box_node SET data = ?2 WHERE nodeno = ?1", 8 + 8 * 4}};

// A node of an R*Tree is its depth and the number of its entries, 16 bits each, and the entries;
// false if nothing stands after them.
bool WipeTail(size_t entry_bytes, std::string* node) {
  if (node->size() < 4) return false;
  const size_t count =
      static_cast<uint8_t>((*node)[2]) * size_t{256} + static_cast<uint8_t>((*node)[3]);
  const size_t used = 4 + count * entry_bytes;
  if (used >= node->size()) return false;
  const auto tail = node->begin() + static_cast<std::ptrdiff_t>(used);
  if (std::all_of(tail, node->end(), [](char c) { return c == '\0'; })) return false;
  std::fill(tail, node->end(), '\0');
  return true;
}

// True while there may be more.
absl::StatusOr<bool> WipeSomeNodes(Database& db, const BoxTable& table, int64_t* after) {
  std::vector<std::pair<int64_t, std::string>> wiped;
  int count = 0;
  {
    Query query(db, table.select);
    query.Bind(*after, kBoxNodesPerStep);
    for (; query.Next(); ++count) {
      *after = query.Int(0);
      std::string node(query.Blob(1));
      if (WipeTail(table.entry_bytes, &node)) wiped.emplace_back(*after, std::move(node));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const auto& [number, node] : wiped) {
    DSG_RETURN_IF_ERROR(Query(db, table.update).Bind(number, Query::BlobView{node}).Run());
  }
  return count == kBoxNodesPerStep;
}

}  // namespace

void CopyLogBack(Database& db) {
  if (db.wal_pages() > kCheckpointPages) db.Checkpoint(/*truncate=*/false);
}

absl::Status GivePagesBack(Database& db, const StopCheck& stop) {
  // Files of format 1 cannot shrink in steps until they have been written anew, once.
  DSG_ASSIGN_OR_RETURN(const int64_t mode, db.QueryInt("PRAGMA auto_vacuum"));
  if (mode == 0) return db.WriteAnew();
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const int64_t free_count, db.QueryInt("PRAGMA freelist_count"));
    if (free_count == 0) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(Query(db, kGivePagesBack).Run());
    CopyLogBack(db);
  }
}

absl::Status WipeBoxes(Database& db, const StopCheck& stop) {
  const Database::OpenTables open(&db);
  for (const BoxTable& table : kBoxTables) {
    int64_t after = 0;
    for (bool has_more = true; has_more;) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      const absl::Status wiped = InTransaction(db, [&]() -> absl::Status {
        DSG_ASSIGN_OR_RETURN(has_more, WipeSomeNodes(db, table, &after));
        return absl::OkStatus();
      });
      DSG_RETURN_IF_ERROR(wiped);
      CopyLogBack(db);
    }
  }
  return absl::OkStatus();
}

void Reserve::Make() const {
  struct stat info {};
  const bool is_there = lstat(path_.c_str(), &info) == 0;
  // One that was cut off when its maker was killed is as good as none.
  if (is_there && S_ISREG(info.st_mode) && info.st_size == bytes_ && bytes_ > 0) return;
  if (is_there) Release();
  if (bytes_ <= 0) return;
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  if (error || space.available < static_cast<uint64_t>(bytes_) * kPlenty) return;
  const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW,
                      FileModeIn(folder_));
  if (fd < 0) return;
  // Takes blocks of the disk; a file that was only made long would have none.
  const int failure = posix_fallocate(fd, 0, bytes_);
  close(fd);
  if (failure == 0) return;
  Release();
  Log(LogLevel::kWarning, "no-reserve",
      {{"file", path_}, {"error", std::error_code(failure, std::generic_category()).message()}});
}

bool Reserve::IsThere() const { return access(path_.c_str(), F_OK) == 0; }

bool Reserve::Release() const { return unlink(path_.c_str()) == 0; }

}  // namespace dsg::sqlite
