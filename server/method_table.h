// SPDX-License-Identifier: Apache-2.0
// The methods of the services by the path that gRPC and HTTP name them with.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/served_call.h"

namespace dsg::server {

/// Threads: const after construction.
class MethodTable {
 public:
  /// `questions` serves the methods that read, `commits` those that write and may wait for the
  /// disk. Both must outlive the table and all calls.
  MethodTable(CallRuntime* questions, CallRuntime* commits);
  MethodTable(const MethodTable&) = delete;
  MethodTable& operator=(const MethodTable&) = delete;

  /// The method of "/dsg.v1.MapService/ListMaps"; nullptr if there is none.
  const Method* Find(const std::string& path) const;

  /// By path, in its order: the methods of one service follow one another.
  using ByPath = std::map<std::string, std::unique_ptr<const Method>>;
  const ByPath& methods() const { return methods_; }

 private:
  ByPath methods_;
};

}  // namespace dsg::server
