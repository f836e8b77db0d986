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

absl::Status MapCondition::Check(const std::string& map, const std::string& incarnation_now,
                                 Revision head_now) const {
  if (!incarnation.empty() && incarnation != incarnation_now) {
    return MakeError(Reason::kMapReplaced,
                     absl::StrCat("map \"", map,
                                  "\" is another one than that which was expected, of the same "
                                  "name; look at it again"),
                     {{"map", map}});
  }
  if (head.has_value() && *head != head_now) {
    return MakeError(
        Reason::kParentRevisionStale,
        absl::StrCat("map \"", map, "\" is at revision ", head_now, ", and revision ", *head,
                     " was expected; look at what has changed, then expect ", head_now),
        {{"map", map}, {"newest", absl::StrCat(head_now)}});
  }
  return absl::OkStatus();
}

}  // namespace dsg
