// SPDX-License-Identifier: Apache-2.0
// How long work is told to stop: a question that it asks now and then.
// Nothing is interrupted: only work that asks is stopped.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"

namespace dsg {

/// Returns CANCELLED or DEADLINE_EXCEEDED when the work must stop. May be empty. Called often
/// (every few hundred rows or poses) and only from the calling thread.
using StopCheck = std::function<absl::Status()>;

/// The result of `stop`; OK if it is empty.
inline absl::Status AskStop(const StopCheck& stop) { return stop ? stop() : absl::OkStatus(); }

/// Calls a stop check once every `period` steps, for loops with short iterations.
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
