// SPDX-License-Identifier: Apache-2.0
#include "query/api/call_context.h"

namespace dsg::query {

absl::Status CallContext::Check() const {
  if (cancelled_.load(std::memory_order_relaxed)) {
    return absl::CancelledError("the caller cancelled the call");
  }
  if (deadline_ != Clock::time_point::max() && Clock::now() >= deadline_) {
    return absl::DeadlineExceededError(
        "the call's deadline passed before the answer was complete; ask for less, or give it more "
        "time");
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
