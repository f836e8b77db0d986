// SPDX-License-Identifier: Apache-2.0
// The verb upgrade: brings one map, or all maps of a store, to the newest format.
#include <memory>
#include <string>
#include <vector>

#include "query/cli/map_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {

absl::Status RunUpgrade(const CommonOptions& common, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       GraphStore::Open(common.store, {.program = "dsg upgrade"}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames(store->folder(), common.map));
  if (names.empty()) out << "store " << common.store << " has no maps\n";
  for (const std::string& name : names) {
    DSG_ASSIGN_OR_RETURN(const UpgradeReport report, store->UpgradeMap(name));
    out << name << ": ";
    if (report.copy.empty()) {
      out << "has format " << report.to_format << " already\n";
    } else {
      out << "format " << report.from_format << " to " << report.to_format << "; the old file is "
          << report.copy << ", delete it when you are content\n";
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::cli
