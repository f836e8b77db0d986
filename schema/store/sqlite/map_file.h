// SPDX-License-Identifier: Apache-2.0
// The files of one map: <store>/<map>/graph.db and writer.lock. Creates and opens them, and keeps
// a second writer out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/model/layer.h"
#include "schema/store/row_stream.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// "DSGB" in ASCII: tells `file` and us that a database is one of ours.
inline constexpr int64_t kApplicationId = 0x44534742;

std::string MapFolder(const std::string& store_folder, const std::string& map);
std::string DatabasePath(const std::string& store_folder, const std::string& map);

/// Refuses file systems on which SQLite's shared memory does not work.
absl::Status CheckFileSystem(const std::string& folder);

/// Makes the folder and database of a new map; nobody sees it half made.
absl::Status CreateMapFile(const std::string& store_folder, const MapSpec& spec);

/// Makes the file of a map of rows, which nobody has proven.
absl::Status MakeMapOfRows(const std::string& file, const MapSpec& spec, const RowSource& rows,
                           const StopCheck& stop);

/// Opens a map's database after checking that it is one, of a format that this build reads. Where
/// `spec` is not null it gets the map's.
/// Errors: NOT_FOUND/MAP_UNKNOWN; FAILED_PRECONDITION/NOT_A_STORE or FORMAT_TOO_NEW.
absl::StatusOr<std::unique_ptr<Database>> OpenMapFile(const std::string& store_folder,
                                                      const std::string& map, Database::Mode mode,
                                                      MapSpec* spec = nullptr);
/// The same for a map of an older format, whose tables are not as this program expects them.
absl::StatusOr<std::unique_ptr<Database>> OpenAnyFormat(const std::string& store_folder,
                                                        const std::string& map, Database::Mode mode,
                                                        MapSpec* spec = nullptr);
/// Whether it is a map of the format that this program reads and writes.
/// Errors: FAILED_PRECONDITION/NOT_A_STORE, FORMAT_TOO_NEW or FORMAT_TOO_OLD.
absl::Status CheckFormat(Database& db);

/// Returns when the file's bytes are on the disk.
absl::Status SyncFile(const std::string& path);
/// The same for the names in a folder.
absl::Status SyncFolder(const std::string& folder);

absl::StatusOr<MapSpec> ReadMapSpec(Database& db);

/// Random text that no other map has; see MapReader::incarnation.
std::string NewIncarnation();
absl::StatusOr<std::string> ReadIncarnation(Database& db);

/// Which file it is, whatever its name.
struct FileIdentity {
  uint64_t device = 0;
  uint64_t inode = 0;
  bool operator==(const FileIdentity&) const = default;
};

/// nullopt when there is no such file (any more).
std::optional<FileIdentity> IdentityOf(const std::string& store_folder, const std::string& map);

/// Bytes of the database, its write-ahead log and the lock file.
int64_t BytesOnDisk(const std::string& store_folder, const std::string& map);

/// Bytes of the write-ahead log alone; 0 when there is none.
int64_t LogBytesOnDisk(const std::string& store_folder, const std::string& map);

/// Files beside those of the map, and copies under way in the store's folder, whoever makes them.
/// Order: by path.
std::vector<std::string> ListOtherFiles(const std::string& store_folder, const std::string& map);

/// Held by the one process that may write a map; released when destroyed or when the process ends,
/// however it ends.
class WriterLock {
 public:
  /// Errors: UNAVAILABLE/WRITER_LOCKED naming program and process id of the holder;
  /// NOT_FOUND/MAP_UNKNOWN if the map's folder is gone.
  static absl::StatusOr<std::unique_ptr<WriterLock>> Acquire(const std::string& store_folder,
                                                             const std::string& map,
                                                             const std::string& program);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  explicit WriterLock(int fd) : fd_(fd) {}
  int fd_;
};

/// The lock of a map that is to be made, with its folder, which is made if it is not there.
/// Errors: as WriterLock::Acquire.
absl::StatusOr<std::unique_ptr<WriterLock>> LockNewMap(const std::string& store_folder,
                                                       const std::string& map,
                                                       const std::string& program);

}  // namespace dsg::sqlite
