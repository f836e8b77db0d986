// SPDX-License-Identifier: Apache-2.0
// Which format a log is in, told by its content and the shape of its folder, never by a name's
// ending.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// The names that --format takes, besides "auto".
const std::vector<std::string>& FormatNames();

/// "obsmat, trajnet, ...".
std::string FormatList();

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED listing the formats when nothing fits.
absl::StatusOr<std::string> DetectFileFormat(std::string_view bytes, const std::string& path);
absl::StatusOr<std::string> DetectFolderFormat(const std::string& folder);

/// Of a bag, by its first bytes: "rosbag", "mcap" or "rosbag2"; empty for other files.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED for bags of version 1.
absl::StatusOr<std::string> DetectBagFormat(const std::string& path);

/// Whether a format is a recording of ROS messages.
bool IsBagFormat(std::string_view format);

/// Whether bytes begin like a bag of any version or kind.
bool IsBagBegin(std::string_view bytes);

/// The ground truth inside an EuRoC folder ("mav0", its parent, or
/// "state_groundtruth_estimate0"); empty when the folder is none.
std::string FindEurocFile(const std::string& folder);

}  // namespace dsg::ingest
