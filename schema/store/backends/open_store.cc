// SPDX-License-Identifier: Apache-2.0
// The one place that knows all backends.
#include "schema/store/graph_store.h"
#include "schema/store/memory/memory_store.h"
#include "schema/store/sqlite/map_file.h"
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

std::string MapFilePath(const std::string& store_folder, const std::string& map) {
  return sqlite::DatabasePath(store_folder, map);
}

}  // namespace dsg
