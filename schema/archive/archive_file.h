// SPDX-License-Identifier: Apache-2.0
// Writes and reads .dsgz files, piece by piece. Nothing in a file is believed before its checksum
// was, no memory is taken for a size that was only declared, and a database whose size is not the
// one declared is refused.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/archive/archive_format.h"
#include "schema/archive/file_io.h"
#include "schema/base/stop_check.h"
#include "schema/store/map_writer.h"

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

/// Gets the bytes of the database in order, a frame a call.
using ByteSink = std::function<absl::Status(std::string_view)>;

/// What the file says of itself, the rest unread.
/// Errors: NOT_FOUND; FILE_MALFORMED; FORMAT_TOO_NEW; STORE_CORRUPT.
absl::StatusOr<ArchiveManifest> ReadArchiveManifest(const std::string& path);

/// Reads and checks the whole file. `sink` and `progress` may be empty. What `sink` got is worth
/// nothing unless this returns OK.
/// Errors: as ReadArchiveManifest; what `sink` and `stop` return.
absl::StatusOr<ArchiveManifest> ReadArchiveFile(const std::string& path, const ByteSink& sink,
                                                const StopCheck& stop, const Progress& progress);

}  // namespace dsg
