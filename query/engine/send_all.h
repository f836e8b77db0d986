// SPDX-License-Identifier: Apache-2.0
// A stream by pulling, for callers who want it pushed.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <thread>

#include "query/engine/service_core.h"
#include "schema/base/status.h"

namespace dsg::query {

/// How soon a call that waits for news sees that it was cancelled.
inline constexpr std::chrono::milliseconds kCancelPeriod{20};

template <typename Reply>
absl::Status SleepUntilNews(const CallContext& call, StreamCursor<Reply>* cursor) {
  for (auto left = cursor->Wait(); left.count() > 0; left = cursor->Wait()) {
    DSG_RETURN_IF_ERROR(call.Check());
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, kCancelPeriod));
  }
  return call.Check();
}

/// Calls `send` for each message until it returns false.
template <typename Reply>
absl::Status SendAll(const CallContext& call, StreamCursor<Reply>* cursor,
                     const std::function<bool(const Reply&)>& send) {
  Reply message;
  do {
    DSG_RETURN_IF_ERROR(SleepUntilNews(call, cursor));
    message.Clear();
    DSG_RETURN_IF_ERROR(cursor->Next(call, &message));
  } while (send(message) && !cursor->done());
  return absl::OkStatus();
}

}  // namespace dsg::query
