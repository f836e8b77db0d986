// SPDX-License-Identifier: Apache-2.0
#include "server/access/caller.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

using query::Role;

constexpr std::array<std::pair<Role, std::string_view>, 4> kRoles = {
    {{Role::kReader, "reader"},
     {Role::kWriter, "writer"},
     {Role::kMaintainer, "maintainer"},
     {Role::kAdmin, "admin"}}};

bool Matches(std::string_view pattern, std::string_view map) {
  if (pattern.empty() || pattern.back() != '*') return pattern == map;
  return map.substr(0, pattern.size() - 1) == pattern.substr(0, pattern.size() - 1);
}

}  // namespace

std::shared_ptr<const Caller> Caller::Anybody() {
  static const auto anybody =
      std::make_shared<const Caller>("", std::vector<Grant>{{Role::kAdmin, {"*"}}});
  return anybody;
}

std::optional<Role> Caller::RoleIn(std::string_view map) const {
  std::optional<Role> highest;
  for (const Grant& grant : grants_) {
    const bool is_there =
        std::any_of(grant.maps.begin(), grant.maps.end(),
                    [&](const std::string& pattern) { return Matches(pattern, map); });
    if (is_there) highest = std::max(grant.role, highest.value_or(Role::kReader));
  }
  return highest;
}

std::optional<Role> Caller::HighestRole() const {
  std::optional<Role> highest;
  for (const Grant& grant : grants_) {
    highest = std::max(grant.role, highest.value_or(Role::kReader));
  }
  return highest;
}

absl::Status Caller::Check(Role role, std::string_view map) const {
  const std::optional<Role> own = RoleIn(map);
  if (!own.has_value()) {
    const std::string shown = CutText(map, 100);
    return MakeError(Reason::kMapUnknown,
                     absl::StrCat("\"", name_, "\" may see no map \"", shown,
                                  "\", if there is one; ListMaps tells which it may"),
                     {{"map", shown}});
  }
  if (*own >= role) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat("\"", name_, "\" is ", std::string(NameOf(*own)), " of map \"",
                   CutText(map, 100), "\", and the call needs the role ", std::string(NameOf(role)),
                   "; ask who keeps the server's access file"));
}

std::string_view NameOf(Role role) { return kRoles[static_cast<size_t>(role)].second; }

std::optional<Role> RoleOfName(std::string_view name) {
  for (const auto& [role, its_name] : kRoles) {
    if (name == its_name) return role;
  }
  return std::nullopt;
}

}  // namespace dsg::server
