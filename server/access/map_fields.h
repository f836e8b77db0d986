// SPDX-License-Identifier: Apache-2.0
// Which maps a request names, and what its caller needs in each.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "query/api/method_info.h"
#include "server/access/caller.h"

namespace google::protobuf {
class Descriptor;
class FieldDescriptor;
class Message;
}  // namespace google::protobuf

namespace dsg::server {

/// Of one type of requests. Found by the rules of the protos: a field `map`, which is a name or a
/// MapSpec with one, in the request or in its `delta`; and fields with the option role_there.
///
/// Threads: const after construction.
class MapFields {
 public:
  /// `role`: of the method, for its own map.
  MapFields(const google::protobuf::Descriptor& request, query::Role role);

  /// Errors: those of Caller::Check for the first map in which it may not do this.
  absl::Status Check(const Caller& caller, const google::protobuf::Message& request) const;

  /// The other map that a request names; empty for none.
  std::string OtherOf(const google::protobuf::Message& request) const;

  /// Whether requests name no map.
  bool empty() const { return fields_.empty(); }

 private:
  struct Field {
    std::vector<const google::protobuf::FieldDescriptor*> path;
    query::Role role = query::Role::kAdmin;
    bool is_other = false;
  };

  std::vector<Field> fields_;
};

}  // namespace dsg::server
