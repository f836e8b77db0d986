// SPDX-License-Identifier: Apache-2.0
#include "schema/store/tag_list.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

constexpr size_t kNamedMax = 20;

}  // namespace

std::string TagNames(const std::vector<Tag>& tags) {
  if (tags.empty()) return "none";
  std::string names;
  for (size_t i = 0; i < std::min(tags.size(), kNamedMax); ++i) {
    absl::StrAppend(&names, i == 0 ? "" : ", ", tags[i].name);
  }
  if (tags.size() > kNamedMax) absl::StrAppend(&names, " and ", tags.size() - kNamedMax, " more");
  return names;
}

}  // namespace dsg
