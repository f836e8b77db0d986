// SPDX-License-Identifier: Apache-2.0
// From an archive to a map of a store. The map appears whole and verified, or not at all.
// Refuses to touch a map that a process writes.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/archive/archive_format.h"
#include "schema/base/stop_check.h"
#include "schema/store/graph_store.h"

namespace dsg {

struct RestoreOptions {
  /// Of the map in the store; empty = as it was called.
  std::string name;
  /// A map of that name may be replaced.
  bool replace = false;
};

/// Errors: as ReadArchiveFile; ALREADY_EXISTS/MAP_EXISTS unless it may be replaced;
/// UNAVAILABLE/WRITER_LOCKED; DATA_LOSS/STORE_CORRUPT for a map that is not what the archive says;
/// RESOURCE_EXHAUSTED/DISK_FULL. The store is then as it was.
absl::StatusOr<ArchiveManifest> RestoreArchive(const std::string& path, GraphStore* store,
                                               const RestoreOptions& options, const StopCheck& stop,
                                               const Progress& progress);

/// Errors: ALREADY_EXISTS/MAP_EXISTS for a map that is there, readable or not.
absl::Status CheckNameIsFree(GraphStore* store, const std::string& name);

/// Whether a map that is to be replaced is at rest; fine if there is none. For whoever restores
/// several: what holds now may not hold later.
/// Errors: UNAVAILABLE/WRITER_LOCKED naming who writes it.
absl::Status CheckMayReplace(GraphStore* store, const std::string& name);

/// Proves that an archive can be restored, in a temporary folder of the system: every byte of the
/// file, then the map in it as MapReader::Verify does.
/// Errors: as RestoreArchive, but for those about the store.
absl::StatusOr<VerifyReport> VerifyArchive(const std::string& path, const StopCheck& stop,
                                           const Progress& progress);

}  // namespace dsg
