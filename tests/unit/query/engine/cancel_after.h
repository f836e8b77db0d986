// SPDX-License-Identifier: Apache-2.0
// Cancels a call while it works, and says how much work it did after that.
// Refuses to count time in which the machine did something else.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "query/service/service_core.h"

namespace dsg::test {

using Ask = std::function<absl::Status(query::ServiceCore*, const query::CallContext&)>;

struct Cancelled {
  absl::Status status;
  /// Of the asking thread, from the cancel to the answer; 0 if the answer came first.
  double late_ms = 0.0;
};

/// Asks in this thread, and cancels from another one after `delay_ms`.
Cancelled CancelAfter(const Ask& ask, query::ServiceCore* core, double delay_ms);

}  // namespace dsg::test
