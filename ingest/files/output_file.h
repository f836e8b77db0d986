// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all, and numbers as text, fast.
// Refuses to leave half a file under its final name.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// Writes to PATH.part and renames on Commit(); removes PATH.part when dropped before.
///
/// Threads: one caller at a time.
class OutputFile {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what the system says.
  static absl::StatusOr<OutputFile> Create(const std::string& path);
  OutputFile(OutputFile&&) = default;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// The text to come; whoever appends to it calls Flush() between rows.
  std::string& buffer() { return buffer_; }
  /// Writes the buffer out once it is large. Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE.
  absl::Status Flush();
  /// Writes the rest, syncs and renames. The last call.
  absl::Status Commit();
  int64_t byte_count() const { return byte_count_ + static_cast<int64_t>(buffer_.size()); }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  OutputFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  absl::Status WriteBuffer();
  absl::Status Failure(const char* what) const;

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::string buffer_;
  int64_t byte_count_ = 0;
};

/// A whole file at once. Errors: of Create and Commit.
absl::Status WriteFile(const std::string& path, std::string bytes);

/// "-12.345000" with `decimals` (1 to 9) digits after the point; "0" for zero.
/// Requires: |value| * 10^decimals < 2^63.
void AppendFixed(double value, int decimals, std::string* out);
void AppendInteger(int64_t value, std::string* out);

}  // namespace dsg::ingest
