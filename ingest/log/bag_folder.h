// SPDX-License-Identifier: Apache-2.0
// The folders that ROS 2 records into.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// Whether a folder has a metadata.yaml of rosbag2, or .mcap or .db3 files.
bool IsBagFolder(const std::string& folder);

/// The files of the bag in the order in which they were recorded: as metadata.yaml lists them, or
/// by the numbers in their names if there is none.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming a file that is listed and not there, a list that
/// cannot be read, or files that are compressed as a whole.
absl::StatusOr<std::vector<std::string>> ListBagFolder(const std::string& folder);

}  // namespace dsg::ingest
