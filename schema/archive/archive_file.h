// SPDX-License-Identifier: Apache-2.0
// Reads .dsgz files. Nothing in them is believed before its checksum was, and no memory is taken
// for a size that was only declared.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/archive/archive_format.h"
#include "schema/base/stop_check.h"
#include "schema/store/map_writer.h"

namespace dsg {

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
