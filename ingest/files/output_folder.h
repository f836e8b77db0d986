// SPDX-License-Identifier: Apache-2.0
// Folders to write into: whether one may, whether there is room, and making them.
// Refuses to delete anything.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace dsg::ingest {

/// Whether a folder holds a file at any depth; empty folders do not count, a folder that cannot
/// be read does.
bool HoldsFiles(const std::string& folder);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID when `path` is something else than a folder.
absl::Status CheckIsFolderOrMissing(const std::string& path);

/// Better now than after an hour of writing. `advice`: what to lower when the disk is too small.
/// Errors: RESOURCE_EXHAUSTED/DISK_FULL with what is free and what is needed.
absl::Status CheckDiskSpace(const std::string& path, double needed_bytes,
                            const std::string& advice);

/// With its parents. Errors: INVALID_ARGUMENT/FIELD_INVALID naming the folder and the reason.
absl::Status MakeFolder(const std::string& path);

}  // namespace dsg::ingest
