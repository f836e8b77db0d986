// SPDX-License-Identifier: Apache-2.0
#include "query/cli/map_names.h"

namespace dsg::cli {

absl::StatusOr<std::vector<std::string>> MapNames(GraphStore* store, const std::string& asked) {
  if (!asked.empty()) return std::vector<std::string>{asked};
  return store->MapNames();
}

}  // namespace dsg::cli
