// SPDX-License-Identifier: Apache-2.0
// A backup: a folder of archives, one a map, and a MANIFEST that names them, written last.
// It is at any instant the old backup, whole, or the new one; refuses folders of anything else.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/archive/file_io.h"
#include "schema/base/stop_check.h"
#include "schema/files/atomic_file.h"
#include "schema/model/node.h"
#include "schema/model/revision.h"
#include "schema/store/map_writer.h"

namespace dsg {

struct BackupEntry {
  std::string map;
  /// In the folder of the manifest.
  std::string file;
  int64_t byte_count = 0;
  /// Of the file.
  Sha256 sha256{};
  Revision newest_revision = 0;
  Sha256 newest_digest{};
  /// As the archive's manifest has it.
  Sha256 state{};
};

struct BackupManifest {
  /// Order: by map, each once.
  std::vector<BackupEntry> maps;

  const BackupEntry* Find(std::string_view map) const;
};

/// JSON, and a last line with its SHA-256.
std::string EncodeBackupManifest(const BackupManifest& manifest);
/// `path` is for errors. Errors: DATA_LOSS/STORE_CORRUPT; FAILED_PRECONDITION/FORMAT_TOO_NEW.
absl::StatusOr<BackupManifest> DecodeBackupManifest(const std::string& path, std::string_view text);

/// Errors: NOT_FOUND without the folder, or MANIFEST in it: such a backup was never finished;
/// DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<BackupManifest> ReadBackupManifest(const std::string& folder);

/// Whether an archive of a backup is the one that the manifest means, by its size and SHA-256, and
/// by what it says of its map.
/// Errors: DATA_LOSS/STORE_CORRUPT, also for a file that is gone; as ReadArchiveManifest; what
/// `stop` returned.
absl::Status CheckBackupFile(const std::string& folder, const BackupEntry& entry,
                             const StopCheck& stop, const Progress& progress);

/// An archive on its way into a backup.
///
/// Threads: one caller at a time.
class BackupFile {
 public:
  /// Errors: as AtomicFile::Create.
  static absl::StatusOr<BackupFile> Create(const std::string& folder, const std::string& map);

  absl::Status Write(std::string_view bytes);
  /// Reads what was written, checks it, and gives it its name. The last call.
  /// Errors: as AtomicFile; DATA_LOSS/STORE_CORRUPT when it is no whole archive of the map.
  absl::StatusOr<BackupEntry> Commit(const StopCheck& stop);

 private:
  BackupFile(std::string folder, std::string map, AtomicFile file)
      : folder_(std::move(folder)), map_(std::move(map)), file_(std::move(file)) {}

  std::string folder_;
  std::string map_;
  AtomicFile file_;
  Sha256Stream sha256_;
};

/// The folder while it is being written.
class BackupFolder {
 public:
  /// Makes the folder if it is missing.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a folder of other things; WRITER_LOCKED while
  /// another process writes it; STORE_CORRUPT for a damaged manifest.
  static absl::StatusOr<std::unique_ptr<BackupFolder>> Open(const std::string& folder);
  ~BackupFolder();
  BackupFolder(const BackupFolder&) = delete;
  BackupFolder& operator=(const BackupFolder&) = delete;

  /// As it was before; empty for a new one.
  const BackupManifest& last() const { return last_; }
  /// Writes the manifest and removes archives that it does not name.
  absl::Status Finish(const BackupManifest& manifest);

 private:
  BackupFolder(std::string folder, int lock_fd) : folder_(std::move(folder)), lock_fd_(lock_fd) {}

  const std::string folder_;
  const int lock_fd_;
  BackupManifest last_;
};

}  // namespace dsg
