// SPDX-License-Identifier: Apache-2.0
// What the head of a request says of its call: method, form of the bodies, deadline.
#pragma once

#include <cstddef>
#include <memory>
#include <variant>

#include "server/http/connect.h"
#include "server/http/request_head.h"
#include "server/method_table.h"

namespace dsg::server {

struct CallPlan {
  const Method* method = nullptr;
  ConnectType type;
  CallerDeadline deadline = CallerDeadline::max();
  KnownCaller caller;
  /// Longest body.
  size_t body_bytes_max = 0;
};

/// `may_write`: also calls that change maps.
std::variant<CallPlan, Refusal> PlanCall(const MethodTable& methods, const RequestHead& head,
                                         bool may_write);

}  // namespace dsg::server
