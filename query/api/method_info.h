// SPDX-License-Identifier: Apache-2.0
// What the service protos say of a method beside its types; see proto/dsg/v1/options.proto.
#pragma once

#include <string_view>

namespace dsg::query {

/// What bounds a stream.
enum class Lifetime {
  /// Ends by itself, within the server's longest deadline.
  kAnswer,
  /// Lasts as long as its reader wants.
  kWatch,
  /// Ends by itself, whenever that is.
  kWork,
};

/// What a caller may do in a map; each includes those before it.
enum class Role { kReader, kWriter, kMaintainer, kAdmin };

struct MethodInfo {
  /// "QueryService", of the package dsg.v1.
  std::string_view service;
  /// "GetNode".
  std::string_view name;
  /// Changes nothing, so a client may repeat it.
  bool may_repeat = false;
  /// Runs beside the commits.
  bool writes = false;
  /// A worker of the server may wait for memory.
  bool waits_for_memory = false;
  Lifetime lifetime = Lifetime::kAnswer;
  /// What its caller needs in the map of the request.
  Role role = Role::kAdmin;
};

}  // namespace dsg::query
