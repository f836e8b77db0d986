// SPDX-License-Identifier: Apache-2.0
// A store in the memory of this process: the plainest backend there is. What it answers is what
// every backend must answer, so tests compare others with it; notebooks and tests use it where
// nothing needs to stay. Clarity goes before speed: a question may look at all rows.
#pragma once

#include <memory>
#include <string>

#include "schema/store/graph_store.h"

namespace dsg::memory {

/// The store of that name, which all who open it share. It lives as long as somebody holds it, a
/// map of it, a writer or a snapshot keeps what it needs.
/// Errors: NOT_FOUND/MAP_UNKNOWN if nobody has it open, unless options.create.
absl::StatusOr<std::unique_ptr<GraphStore>> OpenMemoryStore(const std::string& name,
                                                            const StoreOptions& options);

}  // namespace dsg::memory
