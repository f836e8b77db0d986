// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all: written under another name, synced, then renamed.
// Refuses to leave half a file under its final name, also when the disk fills or the power fails.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

/// What stands at the end of a path while its file is being written.
inline constexpr char kPartSuffix[] = ".part";

/// Whether a file may be written to `path`. `may_replace`: one that is there may be replaced;
/// `advice` says how to allow that ("add --force").
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what to do, also for what is no
/// plain file.
absl::Status CheckMayWrite(const std::string& path, bool may_replace,
                           std::string_view advice = "add --force");

/// Writes to PATH.part and renames on Commit(); removes PATH.part when dropped before. What was
/// there under that name, of a run that was killed, goes; a link goes, and not what it points to.
///
/// Threads: one caller at a time.
class AtomicFile {
 public:
  /// Replaces what is at `path` on Commit(); ask CheckMayWrite first.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what the system says;
  /// RESOURCE_EXHAUSTED/DISK_FULL.
  static absl::StatusOr<AtomicFile> Create(const std::string& path);
  /// As CheckMayWrite, then as above.
  static absl::StatusOr<AtomicFile> Create(const std::string& path, bool may_replace);
  AtomicFile(AtomicFile&&) = default;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE.
  absl::Status Write(std::string_view bytes);
  /// Syncs the file, renames it and syncs its folder. The last call. Errors: as Write, also when
  /// another writer of the same path began later.
  absl::Status Commit();
  const std::string& path() const { return path_; }
  int64_t byte_count() const { return byte_count_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  AtomicFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  absl::Status Failure(const char* what) const;
  /// False once another writer of the same path has put its own file there.
  bool IsPartOurs() const;

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  int64_t byte_count_ = 0;
};

/// A whole file at once. Errors: of Create, Write and Commit.
absl::Status WriteAtomically(const std::string& path, std::string_view bytes);

/// Makes names created, renamed and removed in a folder survive a loss of power.
/// Errors: UNAVAILABLE naming the folder.
absl::Status SyncFolder(const std::string& folder);

}  // namespace dsg
