// SPDX-License-Identifier: Apache-2.0
// Makes the bytes of an archive from a database file, piece by piece as they are asked for.
// Refuses a file whose size is not the one declared.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "schema/archive/archive_format.h"
#include "schema/archive/file_io.h"
#include "schema/archive/sha256_stream.h"
#include "schema/base/stop_check.h"

namespace dsg {

/// No piece is larger.
inline constexpr size_t kArchivePieceBytes = size_t{1} << 20;

/// The same database and manifest make the same bytes with one release of zstd.
///
/// Threads: one caller at a time.
class ArchiveEncoder {
 public:
  ArchiveEncoder(InputFile database, ArchiveManifest manifest);

  /// The next bytes of the file; empty once all were given.
  /// Errors: UNAVAILABLE; DATA_LOSS/STORE_CORRUPT for a database of another size.
  absl::StatusOr<std::string> Next(const StopCheck& stop);
  bool done() const { return has_ended_ && next_ == ready_.size(); }
  /// From 0 to 1.
  double progress() const;
  const ArchiveManifest& manifest() const { return manifest_; }

 private:
  absl::Status AddFrame();
  void AddEnd();

  InputFile database_;
  const ArchiveManifest manifest_;
  const int64_t frame_count_;
  int64_t frame_index_ = 0;
  bool has_ended_ = false;
  Sha256Stream all_;
  /// Made and not given yet, from `next_` on.
  std::string ready_;
  size_t next_ = 0;
};

}  // namespace dsg
