// SPDX-License-Identifier: Apache-2.0
// The rows of a map as bytes: what an archive of rows holds in its frames, instead of a database.
//
//   row     its kind (u8), its numbers, its texts; as many of each as the kind has
//   number  zigzag, then a varint
//   text    a varint of its length, and its bytes
//
// Refuses to take memory for a length that was only declared.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "schema/archive/archive_format.h"
#include "schema/archive/file_io.h"
#include "schema/store/row_stream.h"

namespace dsg {

void AppendRow(const StreamRow& row, std::string* out);

/// Rows of a file, from its begin to its end.
///
/// Threads: one caller at a time.
class RowFileReader {
 public:
  /// `map` is for messages.
  RowFileReader(InputFile file, std::string map) : file_(std::move(file)), map_(std::move(map)) {}

  /// False after the last row. Errors: DATA_LOSS/STORE_CORRUPT; UNAVAILABLE.
  absl::StatusOr<bool> Next(StreamRow* row);

 private:
  /// Makes `size` bytes readable, or all that are left.
  absl::Status Fill(size_t size);
  std::string_view ready() const { return std::string_view(buffer_).substr(at_); }
  absl::StatusOr<uint64_t> Varint();
  absl::Status Damaged() const;

  InputFile file_;
  const std::string map_;
  std::string buffer_;
  size_t at_ = 0;
  /// Of the file, in the buffer or passed.
  int64_t taken_ = 0;
};

/// What the rows of a map say of it.
class RowsSummary {
 public:
  void Take(const StreamRow& row);
  /// Without what only the archive knows: its size and program.
  ArchiveManifest Describe(const MapSpec& spec) const;

 private:
  Revision oldest_ = 0;
  Revision newest_ = 0;
  Sha256 newest_digest_{};
  std::vector<Tag> tags_;
};

}  // namespace dsg
