// SPDX-License-Identifier: Apache-2.0
// The memory that requests and replies may take together, and how much of it one connection may.
// A call is charged before it allocates, and refused when there is no more.
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

/// Two shares, since calls that wait for a worker must not take what those that run need to end: a
/// quarter for requests that wait, as bytes, and the rest for messages and replies.
///
/// Threads: safe from any thread.
class CallMemory {
 public:
  /// What one call holds, given back when destroyed.
  ///
  /// Threads: one caller at a time.
  class Hold {
   public:
    Hold(CallMemory* memory, std::shared_ptr<Connection> connection)
        : memory_(memory), connection_(std::move(connection)) {}
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

    /// Holds a request of `bytes` until StopWaiting. Small ones are free: how many calls may wait
    /// bounds them, and they are not to suffer from large ones.
    ///
    /// Errors: RESOURCE_EXHAUSTED/OVERLOADED while others hold too much.
    absl::Status Wait(size_t bytes);
    void StopWaiting();

    /// Holds `bytes` of messages instead of what it held of them. What it held stays on errors.
    ///
    /// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED above bytes_max_of_call(), which no pause helps;
    /// RESOURCE_EXHAUSTED/OVERLOADED while others hold too much.
    absl::Status Resize(size_t bytes);
    /// The same, but sleeps until others hold less or the call must stop.
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
  /// Of all calls, as of now.
  size_t bytes() const { return waiting_bytes_ + bytes_; }

 private:
  // Adds to what a connection and what all of them hold, unless either would be too much.
  static absl::Status Charge(std::atomic<size_t>* of_connection, size_t connection_max,
                             std::atomic<size_t>* of_all, size_t max, size_t bytes);

  const size_t bytes_max_;
  std::atomic<size_t> waiting_bytes_{0};
  std::atomic<size_t> bytes_{0};
  std::mutex mutex_;
  std::condition_variable released_;
};

}  // namespace dsg::server
