// SPDX-License-Identifier: Apache-2.0
// The maps of a store that a verb about files means.
#pragma once

#include <string>
#include <vector>

#include "schema/store/graph_store.h"

namespace dsg::cli {

/// The one asked for, or all of them, also those that cannot be opened. Order: by name.
/// Errors: UNAVAILABLE for a store that cannot be listed.
absl::StatusOr<std::vector<std::string>> MapNames(GraphStore* store, const std::string& asked);

}  // namespace dsg::cli
