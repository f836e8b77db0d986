// SPDX-License-Identifier: Apache-2.0
// Files that a verb writes: they appear whole or not at all.
// Refuses to replace a file unless told to, and anything that is no plain file always.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::cli {

/// `force`: a file that is there may be replaced.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what to do.
absl::Status CheckMayWrite(const std::string& path, bool force);

/// Writes to PATH.part and renames on Commit(); removes PATH.part when dropped before.
///
/// Threads: one caller at a time.
class OutputFile {
 public:
  /// Errors: as CheckMayWrite; INVALID_ARGUMENT/FIELD_INVALID with what the system says.
  static absl::StatusOr<OutputFile> Create(const std::string& path, bool force);
  OutputFile(OutputFile&&) = default;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE.
  absl::Status Write(std::string_view bytes);
  /// Syncs and renames. The last call. Errors: as Write.
  absl::Status Commit();
  const std::string& path() const { return path_; }
  int64_t byte_count() const { return byte_count_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  OutputFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  absl::Status Failure(const char* what) const;

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  int64_t byte_count_ = 0;
};

}  // namespace dsg::cli
