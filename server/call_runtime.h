// SPDX-License-Identifier: Apache-2.0
// What every call needs: the engine, threads to run on, the log.
#pragma once

#include <atomic>

#include "query/engine/service_core.h"
#include "server/call_guard.h"
#include "server/call_log.h"
#include "server/delay_queue.h"
#include "server/worker_pool.h"

namespace dsg::server {

/// Owned by the server; outlives all calls.
struct CallRuntime {
  query::ServiceCore* core = nullptr;
  WorkerPool* workers = nullptr;
  CallGuard* guard = nullptr;
  CallLog log{false};
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

/// RESOURCE_EXHAUSTED/OVERLOADED.
absl::Status OverloadedError();
/// The same, for a watch too many.
absl::Status TooManyWatchesError(int watch_max);
/// UNAVAILABLE/SHUTTING_DOWN.
absl::Status ShuttingDownError();

}  // namespace dsg::server
