// SPDX-License-Identifier: Apache-2.0
#include "server/http/request_head.h"

#include <algorithm>

#include "absl/strings/match.h"

namespace dsg::server {
namespace {

bool IsNamed(std::string_view field, std::string_view name) {
  return absl::EqualsIgnoreCase(absl::string_view(field.data(), field.size()),
                                absl::string_view(name.data(), name.size()));
}

}  // namespace

std::optional<std::string_view> RequestHead::Find(std::string_view name) const {
  for (const auto& [field, value] : fields) {
    if (IsNamed(field, name)) return value;
  }
  return std::nullopt;
}

int RequestHead::Count(std::string_view name) const {
  return static_cast<int>(std::count_if(
      fields.begin(), fields.end(), [&](const auto& field) { return IsNamed(field.first, name); }));
}

}  // namespace dsg::server
