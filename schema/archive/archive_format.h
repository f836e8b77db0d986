// SPDX-License-Identifier: Apache-2.0
// A .dsgz file: one map with all of its history. docs/backup.md has the layout for users.
// Refuses any byte that is not as it was written, and sizes that it did not declare.
//
//   header    "DSGZ" 0d 0a 1a 0a, version (u32), size of the manifest (u32), checksum (u64)
//   manifest  JSON, one object
//   frames    of 1 MiB of the content each, the last one shorter; the content is a database
//             (version 1), or the rows of the map (version 2, row_file.h):
//             size as stored (u32), checksum (u64), bytes (zstd; as they are if nothing is saved)
//   end       "DSGE", number of frames (u32), SHA-256 of all bytes before it
//
// Numbers are little-endian; checksums are XXH3-64 of what follows them, seeded by its number.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/layer.h"
#include "schema/model/revision.h"
#include "schema/store/map_writer.h"

namespace dsg {

/// The newest; an archive of a database has version 1, so that older programs read it.
inline constexpr uint32_t kArchiveVersion = 2;
inline constexpr size_t kArchiveHeaderBytes = 24;
inline constexpr size_t kArchiveManifestBytesMax = size_t{1} << 20;
inline constexpr size_t kArchiveFrameBytes = size_t{1} << 20;
inline constexpr size_t kArchiveFrameHeadBytes = 12;
inline constexpr size_t kArchiveEndBytes = 40;
/// A frame is stored as it is if it would shrink to less than a hundredth, so that no small file
/// unfolds to a huge one.
inline constexpr size_t kArchiveRatioMax = 100;

/// A database of the backend that wrote it, or rows that every backend reads.
enum class ArchiveContent { kDatabase, kRows };

/// What an archive says of itself before its first frame.
struct ArchiveManifest {
  ArchiveContent content = ArchiveContent::kDatabase;
  MapSpec spec;
  int store_format = 0;
  Revision newest_revision = 0;
  Sha256 newest_digest{};
  Revision oldest_revision = 0;
  /// See StateDigest.
  Sha256 state{};
  /// Of the content, whatever it is.
  int64_t database_bytes = 0;
  /// "dsg 0.1.0"
  std::string program;
};

/// All that tells whether a map is what it was: equal states have equal answers at every revision
/// that can be read. Two maps of one history differ in it once one was compacted or erased from.
Sha256 StateDigest(const MapSpec& spec, Revision newest, const Sha256& newest_digest,
                   Revision oldest, const std::vector<Tag>& tags);

/// INVALID_ARGUMENT/FILE_MALFORMED for a file that was never an archive or is not one of this
/// program; DATA_LOSS/STORE_CORRUPT for one that was, and is no more.
absl::Status NoArchive(const std::string& path, std::string_view why);
absl::Status DamagedArchive(const std::string& path, int64_t at_byte, std::string_view why);

/// Header and manifest.
std::string EncodeArchiveHead(const ArchiveManifest& manifest);
/// How many bytes the manifest has. Requires: `header` is of kArchiveHeaderBytes.
/// Errors: FILE_MALFORMED; FORMAT_TOO_NEW.
absl::StatusOr<size_t> ManifestBytes(const std::string& path, std::string_view header);
/// Requires: sizes as ManifestBytes says. Errors: FILE_MALFORMED; STORE_CORRUPT.
absl::StatusOr<ArchiveManifest> DecodeArchiveHead(const std::string& path, std::string_view header,
                                                  std::string_view manifest);

/// Frames of a database of so many bytes.
int64_t FrameCount(int64_t database_bytes);

/// Appends a frame to `out`. Requires: `bytes` is at most kArchiveFrameBytes.
void AppendFrame(int64_t index, std::string_view bytes, std::string* out);
/// Size as stored, from the head of a frame.
uint32_t StoredBytes(std::string_view frame_head);
/// Errors: STORE_CORRUPT without a position or a path, which the caller knows.
absl::Status DecodeFrame(int64_t index, std::string_view frame_head, std::string_view stored,
                         size_t byte_count, std::string* bytes);

std::string EncodeArchiveEnd(int64_t frame_count, const Sha256& all);

}  // namespace dsg
