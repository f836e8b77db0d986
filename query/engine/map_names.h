// SPDX-License-Identifier: Apache-2.0
// The maps of a store folder by name, also those that cannot be opened. Refuses to open any.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::query {

/// Order: ascending.
/// Errors: UNAVAILABLE for a folder that cannot be listed.
absl::StatusOr<std::vector<std::string>> MapNamesIn(const std::string& store_folder);

}  // namespace dsg::query
