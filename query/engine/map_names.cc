// SPDX-License-Identifier: Apache-2.0
#include "query/engine/map_names.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "schema/model/ids.h"

namespace dsg::query {

absl::StatusOr<std::vector<std::string>> MapNamesIn(const std::string& store_folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  std::error_code error;
  // Not by GraphStore::ListMaps, which leaves out what it cannot open: a damaged map would look
  // like none.
  for (fs::directory_iterator it(store_folder, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    std::error_code missing;
    if (IsValidMapName(name) && fs::exists(it->path() / "graph.db", missing)) {
      names.push_back(name);
    }
  }
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot list store ", store_folder, ": ", error.message()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace dsg::query
