// SPDX-License-Identifier: Apache-2.0
// From a map to its archive, whoever writes the map meanwhile.
// Refuses to hold a lock on the map while the archive's bytes are read.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "schema/archive/archive_file.h"
#include "schema/base/stop_check.h"
#include "schema/store/graph_store.h"

namespace dsg {

/// Copies the newest revision, with its history, into a hidden file of folder `scratch`, which is
/// gone when the encoder is, and makes an archive of the copy. The archive depends on what is in
/// the map alone: neither on when nor by whom it was made.
/// Errors: as MapReader::CopyTo; RESOURCE_EXHAUSTED/DISK_FULL.
absl::StatusOr<std::unique_ptr<ArchiveEncoder>> ArchiveMap(MapReader* map,
                                                           const std::string& scratch,
                                                           const StopCheck& stop,
                                                           const Progress& progress);

/// The same for an archive of rows, which every backend can read. The rows are in that folder, for
/// as long as the encoder is.
/// Errors: as MapReader::ReadRows; RESOURCE_EXHAUSTED/DISK_FULL.
absl::StatusOr<std::unique_ptr<ArchiveEncoder>> ArchiveRows(MapReader* map,
                                                            const std::string& scratch,
                                                            const StopCheck& stop);

/// What the archive of a map says of it.
absl::StatusOr<ArchiveManifest> DescribeMap(MapReader* map);

}  // namespace dsg
