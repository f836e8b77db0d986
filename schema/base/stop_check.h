// SPDX-License-Identifier: Apache-2.0
// How long work is told to stop: a question that it asks now and then.
// Nothing is interrupted: only work that asks is stopped.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"

namespace dsg {

/// Tells long work to stop: returns CANCELLED or DEADLINE_EXCEEDED once it must. May be empty.
/// Called often (every few hundred rows or poses) and from the calling thread only.
using StopCheck = std::function<absl::Status()>;

/// What `stop` says, OK if it is empty.
inline absl::Status AskStop(const StopCheck& stop) { return stop ? stop() : absl::OkStatus(); }

/// Asks a stop check once in so many steps, from loops that are too short to ask each time round.
class StopCounter {
 public:
  /// `stop` may be empty, and must outlive this.
  explicit StopCounter(const StopCheck& stop, int64_t period = 4096)
      : stop_(stop), period_(period) {}

  absl::Status Check() {
    if (++count_ < period_) return absl::OkStatus();
    count_ = 0;
    return AskStop(stop_);
  }

 private:
  const StopCheck& stop_;
  const int64_t period_;
  int64_t count_ = 0;
};

}  // namespace dsg
