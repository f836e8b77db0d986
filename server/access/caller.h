// SPDX-License-Identifier: Apache-2.0
// Who calls, and what they may do in which maps. Refuses to find out who it is.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "query/api/method_info.h"

namespace dsg::server {

/// A role in the maps of these names. A name may end with '*', which stands for any rest.
struct Grant {
  query::Role role = query::Role::kReader;
  std::vector<std::string> maps;
};

/// Threads: const after construction.
class Caller {
 public:
  Caller(std::string name, std::vector<Grant> grants)
      : name_(std::move(name)), grants_(std::move(grants)) {}

  /// May do everything: callers of a server that asks nobody who they are.
  static std::shared_ptr<const Caller> Anybody();

  const std::string& name() const { return name_; }
  /// The highest role in a map; nullopt for a map that the caller must not know of.
  std::optional<query::Role> RoleIn(std::string_view map) const;
  /// The highest role in any map.
  std::optional<query::Role> HighestRole() const;

  /// Whether the caller has `role` in `map`.
  ///
  /// Errors: NOT_FOUND for a map that it must not know of, as for one that does not exist;
  /// PERMISSION_DENIED naming the role that it lacks.
  absl::Status Check(query::Role role, std::string_view map) const;

 private:
  std::string name_;
  std::vector<Grant> grants_;
};

/// "reader", "writer", "maintainer", "admin".
std::string_view NameOf(query::Role role);
std::optional<query::Role> RoleOfName(std::string_view name);

}  // namespace dsg::server
