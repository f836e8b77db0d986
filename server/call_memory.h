// SPDX-License-Identifier: Apache-2.0
// Bounds the memory that the requests and replies of all calls, and of one connection, take. A call
// is charged before it allocates, and refused when no memory is left.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/status/status.h"
#include "query/api/call_context.h"
#include "server/connections.h"

namespace dsg::server {

/// Two shares: a quarter for the bytes of requests that wait for a worker, the rest for parsed
/// messages and replies. Waiting calls thus cannot take the memory that running calls need to
/// finish.
///
/// Threads: safe from any thread.
class CallMemory {
 public:
  /// The memory that one call holds; released when destroyed.
  ///
  /// Threads: one caller at a time.
  class Hold {
   public:
    Hold(CallMemory* memory, std::shared_ptr<Connection> connection)
        : memory_(memory), connection_(std::move(connection)) {}
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

    /// Charges a waiting request of `bytes` until StopWaiting. Requests of at most 64 KiB are free:
    /// the number of waiting calls bounds them, and large requests must not shut them out.
    ///
    /// Errors: RESOURCE_EXHAUSTED/OVERLOADED while other calls hold too much.
    absl::Status Wait(size_t bytes);
    void StopWaiting();

    /// Sets the bytes that the call's messages hold. Unchanged on errors.
    ///
    /// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED above bytes_max_of_call(), where a retry cannot
    /// help; RESOURCE_EXHAUSTED/OVERLOADED while other calls hold too much.
    absl::Status Resize(size_t bytes);
    /// The same, but sleeps until other calls hold less or the call must stop.
    ///
    /// Errors: LIMIT_EXCEEDED as above; those of `call`.
    absl::Status AwaitResize(size_t bytes, const query::CallContext& call);

   private:
    CallMemory* const memory_;
    const std::shared_ptr<Connection> connection_;
    size_t waiting_bytes_ = 0;
    size_t bytes_ = 0;
  };

  explicit CallMemory(size_t bytes_max) : bytes_max_(bytes_max) {}

  size_t bytes_max_of_call() const { return bytes_max_ / 2; }
  /// Bytes that all calls hold now.
  size_t bytes() const { return waiting_bytes_ + bytes_; }

 private:
  // Adds to the sums of a connection and of all calls, unless either would exceed its limit.
  static absl::Status Charge(std::atomic<size_t>* of_connection, size_t connection_max,
                             std::atomic<size_t>* of_all, size_t max, size_t bytes);

  const size_t bytes_max_;
  std::atomic<size_t> waiting_bytes_{0};
  std::atomic<size_t> bytes_{0};
  std::mutex mutex_;
  std::condition_variable released_;
};

}  // namespace dsg::server
