// SPDX-License-Identifier: Apache-2.0
#include "schema/store/graph_store.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

absl::Status MapExistsError(const std::string& map) {
  return MakeError(Reason::kMapExists, absl::StrCat("map \"", map, "\" exists already"),
                   {{"map", map}});
}

absl::Status UnknownMapError(const std::string& map, const std::string& store) {
  return MakeError(Reason::kMapUnknown,
                   absl::StrCat("map \"", map, "\" does not exist in store ", store),
                   {{"map", map}, {"store", store}});
}

}  // namespace dsg
