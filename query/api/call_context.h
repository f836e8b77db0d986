// SPDX-License-Identifier: Apache-2.0
// What bounds a call: its deadline and its cancellation.
#pragma once

#include <atomic>
#include <chrono>

#include "absl/status/status.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Threads: Cancel and Check are safe from any thread.
class CallContext {
 public:
  using Clock = std::chrono::steady_clock;

  explicit CallContext(Clock::time_point deadline = Clock::time_point::max())
      : deadline_(deadline) {}

  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  Clock::time_point deadline() const { return deadline_; }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

  /// OK, CANCELLED or DEADLINE_EXCEEDED.
  absl::Status Check() const;

  /// For long reads of the store; must not outlive this context.
  StopCheck stop() const {
    return [this] { return Check(); };
  }

 private:
  Clock::time_point deadline_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace dsg::query
