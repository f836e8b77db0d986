// SPDX-License-Identifier: Apache-2.0
#include "query/cli/map_names.h"

#include "query/engine/map_names.h"

namespace dsg::cli {

absl::StatusOr<std::vector<std::string>> MapNames(const std::string& store_folder,
                                                  const std::string& asked) {
  if (!asked.empty()) return std::vector<std::string>{asked};
  return query::MapNamesIn(store_folder);
}

}  // namespace dsg::cli
