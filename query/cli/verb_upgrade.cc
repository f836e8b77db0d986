// SPDX-License-Identifier: Apache-2.0
// The verb upgrade: brings one map, or all maps of a store, to the newest format.
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "query/cli/map_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {

absl::Status RunUpgrade(const CommonOptions& common, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(common.store, {.program = "dsg upgrade"}));
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapNames(store.get(), common.map));
  if (names.empty() && !common.json) out << "store " << common.store << " has no maps\n";
  nlohmann::ordered_json json = {{"maps", nlohmann::ordered_json::array()}};
  for (const std::string& name : names) {
    DSG_ASSIGN_OR_RETURN(const UpgradeReport report, store->UpgradeMap(name));
    json["maps"].push_back({{"map", name},
                            {"from_format", report.from_format},
                            {"to_format", report.to_format},
                            {"copy", report.copy}});
    if (common.json) continue;
    out << name << ": ";
    if (report.copy.empty()) {
      out << "has format " << report.to_format << " already\n";
    } else {
      out << "format " << report.from_format << " to " << report.to_format << "; the old file is "
          << report.copy << ", delete it when you are content\n";
    }
  }
  if (common.json)
    out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  return absl::OkStatus();
}

}  // namespace dsg::cli
