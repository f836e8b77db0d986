// SPDX-License-Identifier: Apache-2.0
// What every call needs: the engine, threads to run on, memory, the log.
#pragma once

#include <atomic>
#include <string>
#include <string_view>

#include "query/service/service_core.h"
#include "server/arena_blocks.h"
#include "server/arrivals.h"
#include "server/call_guard.h"
#include "server/call_log.h"
#include "server/call_memory.h"
#include "server/connections.h"
#include "server/delay_queue.h"
#include "server/worker_pool.h"

namespace dsg::server {

/// No request and no message of a reply is longer.
inline constexpr int kMessageBytesMaxOnWire = 4 << 20;

/// Owned by the server; outlives all calls.
struct CallRuntime {
  query::ServiceCore* core = nullptr;
  /// Stands in no error that callers see.
  std::string store_folder;
  WorkerPool* workers = nullptr;
  CallGuard* guard = nullptr;
  CallLog log{false};
  Connections* connections = nullptr;
  /// Requests that have not come whole yet.
  Arrivals* arrivals = nullptr;
  /// Of requests that have, and of replies.
  CallMemory* memory = nullptr;
  ArenaBlocks* blocks = nullptr;
  /// Streams that have begun and not ended, whether a worker is at them or their reader is slow.
  std::atomic<int> open_stream_count{0};
  int open_stream_max = 0;
  /// Where streams wait that have nothing to tell yet.
  DelayQueue* delays = nullptr;
  /// Watches, which are not counted among the streams.
  std::atomic<int> open_watch_count{0};
  int open_watch_max = 0;
  /// No call is begun any more, and watches end.
  std::atomic<bool> stopping{false};
};

/// RESOURCE_EXHAUSTED/OVERLOADED; `why` says of what the server has too much.
absl::Status OverloadedError(std::string_view why);
/// The same, for a watch too many.
absl::Status TooManyWatchesError(int watch_max);
/// UNAVAILABLE/SHUTTING_DOWN.
absl::Status ShuttingDownError();

/// What OverloadedError says when calls are refused for their number.
inline constexpr std::string_view kTooManyCalls =
    "the server has as many calls as it takes at a time";

}  // namespace dsg::server
