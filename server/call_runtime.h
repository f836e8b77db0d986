// SPDX-License-Identifier: Apache-2.0
// What every call uses: the engine, workers, limits, the log.
#pragma once

#include <atomic>
#include <string>
#include <string_view>

#include "query/service/service_core.h"
#include "server/access/access_control.h"
#include "server/access/call_audit.h"
#include "server/arena_blocks.h"
#include "server/arrivals.h"
#include "server/call_guard.h"
#include "server/call_log.h"
#include "server/call_memory.h"
#include "server/connections.h"
#include "server/delay_queue.h"
#include "server/worker_pool.h"

namespace dsg::server {

/// Largest request and largest message of a reply, in bytes.
inline constexpr int kMessageBytesMaxOnWire = 4 << 20;

/// Owned by the server; outlives all calls.
struct CallRuntime {
  query::ServiceCore* core = nullptr;
  /// Removed from every error that callers see.
  std::string store_folder;
  WorkerPool* workers = nullptr;
  CallGuard* guard = nullptr;
  CallLog log{false};
  const AccessControl* access = nullptr;
  CallAudit* audit = nullptr;
  Connections* connections = nullptr;
  /// Requests that have not arrived completely.
  Arrivals* arrivals = nullptr;
  /// For requests that have arrived, and for replies.
  CallMemory* memory = nullptr;
  ArenaBlocks* blocks = nullptr;
  /// Streams that have begun and not ended, whether a worker runs them or they wait for their
  /// reader.
  std::atomic<int> open_stream_count{0};
  int open_stream_max = 0;
  /// Streams that have nothing to send yet, and refusals of long requests, wait here.
  DelayQueue* delays = nullptr;
  /// Watches; they do not count as streams.
  std::atomic<int> open_watch_count{0};
  int open_watch_max = 0;
  /// The server accepts no more calls, and watches end.
  std::atomic<bool> stopping{false};
};

/// RESOURCE_EXHAUSTED/OVERLOADED; `why` names the exceeded limit.
absl::Status OverloadedError(std::string_view why);
/// RESOURCE_EXHAUSTED/OVERLOADED for a watch above the limit.
absl::Status TooManyWatchesError(int watch_max);
/// UNIMPLEMENTED: no method has this path.
absl::Status UnknownMethodError(std::string_view path);
/// UNAVAILABLE/SHUTTING_DOWN.
absl::Status ShuttingDownError();

/// The `why` of OverloadedError when there are too many calls.
inline constexpr std::string_view kTooManyCalls =
    "the server has as many calls as it takes at a time";

}  // namespace dsg::server
