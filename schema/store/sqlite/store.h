// SPDX-License-Identifier: Apache-2.0
// A store in a folder: a folder of each map, with one SQLite database.
#pragma once

#include <memory>
#include <string>

#include "schema/store/graph_store.h"

namespace dsg::sqlite {

/// Errors: NOT_FOUND/MAP_UNKNOWN naming the folder; FAILED_PRECONDITION/NETWORK_FILE_SYSTEM.
absl::StatusOr<std::unique_ptr<GraphStore>> OpenSqliteStore(const std::string& folder,
                                                            const StoreOptions& options);

}  // namespace dsg::sqlite
