// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all, and numbers as text, fast.
// Refuses to leave half a file under its final name.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "schema/files/atomic_file.h"

namespace dsg::ingest {

/// An AtomicFile with a buffer that rows of text are appended to.
///
/// Threads: one caller at a time.
class OutputFile {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path and what the system says.
  static absl::StatusOr<OutputFile> Create(const std::string& path);
  /// The text to come; whoever appends to it calls Flush() between rows.
  std::string& buffer() { return buffer_; }
  /// Writes the buffer out once it is large. Errors: RESOURCE_EXHAUSTED/DISK_FULL; UNAVAILABLE.
  absl::Status Flush();
  /// Writes the rest, syncs and renames. The last call.
  absl::Status Commit();
  int64_t byte_count() const { return file_.byte_count() + static_cast<int64_t>(buffer_.size()); }

 private:
  explicit OutputFile(AtomicFile file) : file_(std::move(file)) {}
  absl::Status WriteBuffer();

  AtomicFile file_;
  std::string buffer_;
};

/// A whole file at once. Errors: of Create and Commit.
absl::Status WriteFile(const std::string& path, std::string bytes);

/// "-12.345000" with `decimals` (1 to 9) digits after the point; "0" for zero.
/// Requires: |value| * 10^decimals < 2^63.
void AppendFixed(double value, int decimals, std::string* out);
void AppendInteger(int64_t value, std::string* out);

}  // namespace dsg::ingest
