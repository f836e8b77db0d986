// SPDX-License-Identifier: Apache-2.0
// Pictures of a finished sensor log, so that people look at it before they use it.
// Refuses to change the log; it writes beside it.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::simulator {

/// Reads `folder`/log and `folder`/truth and writes PNGs under `out`: camera.png (with detection
/// boxes), depth.png and labels.png of `count` instants spread over the log, sheet.png with all of
/// them side by side, top.png with rooms and paths. Returns the paths.
///
/// Errors: NOT_FOUND when the folder holds no finished log; those of the truth's reader.
absl::StatusOr<std::vector<std::string>> WriteContactSheet(const std::string& folder, int count,
                                                           const std::string& out);

}  // namespace dsg::simulator
