// SPDX-License-Identifier: Apache-2.0
// Working memory on disk: pieces of bytes in a file without a name, which is gone with the process.
// Refuses to give back other bytes than were put there.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace dsg::ingest {

/// Where a piece lies and what is in it; its owner keeps it. Empty = nowhere.
struct SpillPiece {
  int64_t offset = -1;
  uint32_t byte_count = 0;
  /// Bytes kept for it in the file.
  uint32_t capacity = 0;
  uint64_t digest = 0;

  bool empty() const { return offset < 0; }
};

/// The file is made by Open, or at the first write. It has no name (O_TMPFILE, or unlinked at
/// once), mode 0600, and is not passed on to programs that are started: nothing is left behind
/// however the process ends, and nobody else reads it.
///
/// Threads: Read from many; the rest one caller at a time, and none meanwhile.
class SpillFile {
 public:
  /// `folder`: where the file is to be; empty = TMPDIR, or /tmp.
  explicit SpillFile(std::string folder);
  ~SpillFile();
  SpillFile(const SpillFile&) = delete;
  SpillFile& operator=(const SpillFile&) = delete;

  /// Makes the file now, to know early whether the folder takes one.
  /// Errors: UNAVAILABLE naming the folder.
  absl::Status Open();

  /// Puts `bytes` in the place of what was in `piece`. Nothing is written if they are the same.
  ///
  /// Errors: RESOURCE_EXHAUSTED/DISK_FULL naming the folder; UNAVAILABLE if it takes no file. Then
  /// the piece is as it was, or empty if the disk failed while it was overwritten.
  absl::Status Write(std::string_view bytes, SpillPiece* piece);

  /// Errors: DATA_LOSS if the bytes are others than were written, or fewer; UNAVAILABLE.
  absl::Status Read(const SpillPiece& piece, std::string* bytes) const;

  /// Its room in the file may be used for others.
  void Free(SpillPiece* piece);

  /// Of the file, with room that is free.
  int64_t byte_count() const { return end_; }

 private:
  absl::Status Failure(const char* what, int error) const;

  std::string folder_;
  int file_ = -1;
  int64_t end_ = 0;
  /// Offsets of free room, by its size.
  std::map<uint32_t, std::vector<int64_t>> free_;
};

}  // namespace dsg::ingest
