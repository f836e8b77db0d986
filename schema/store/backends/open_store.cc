// SPDX-License-Identifier: Apache-2.0
// The one place that knows all backends.
#include "schema/store/graph_store.h"
#include "schema/store/memory/memory_store.h"
#include "schema/store/sqlite/store.h"

namespace dsg {

absl::StatusOr<std::unique_ptr<GraphStore>> OpenStore(const std::string& uri,
                                                      const StoreOptions& options) {
  constexpr std::string_view kMemory = "memory:";
  constexpr std::string_view kFile = "file:";
  if (uri.starts_with(kMemory)) {
    return memory::OpenMemoryStore(uri.substr(kMemory.size()), options);
  }
  return sqlite::OpenSqliteStore(uri.starts_with(kFile) ? uri.substr(kFile.size()) : uri, options);
}

}  // namespace dsg
