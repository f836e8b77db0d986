// SPDX-License-Identifier: Apache-2.0
// The maps of a store that a verb about files means.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {

/// The one asked for, or all of them.
inline absl::StatusOr<std::vector<std::string>> MapNames(GraphStore* store,
                                                         const std::string& asked) {
  if (!asked.empty()) return std::vector<std::string>{asked};
  DSG_ASSIGN_OR_RETURN(const std::vector<MapSpec> maps, store->ListMaps());
  std::vector<std::string> names;
  names.reserve(maps.size());
  for (const MapSpec& map : maps) names.push_back(map.name);
  return names;
}

}  // namespace dsg::cli
