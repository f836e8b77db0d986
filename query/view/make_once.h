// SPDX-License-Identifier: Apache-2.0
// What many need and one makes, within its own deadline: the others wait, each within theirs, and
// if the maker must stop, one of them takes over. Refuses to keep what was left half made.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Threads: safe from many threads.
template <typename T>
class MakeOnce {
 public:
  /// What the first `make` that succeeds returns, an absl::StatusOr<std::shared_ptr<T>>.
  /// Errors: what this caller's own `stop` or `make` returned, never another's.
  template <typename Make>
  absl::StatusOr<std::shared_ptr<T>> Get(const StopCheck& stop, const Make& make) {
    if (is_made_) return value_;
    {
      std::unique_lock lock(mutex_);
      while (is_being_made_) {
        made_or_given_up_.wait_for(lock, kWaitSlice);
        lock.unlock();
        DSG_RETURN_IF_ERROR(AskStop(stop));
        lock.lock();
      }
      if (is_made_) return value_;
      is_being_made_ = true;
    }
    absl::StatusOr<std::shared_ptr<T>> made = make();
    {
      const std::lock_guard lock(mutex_);
      is_being_made_ = false;
      if (made.ok()) {
        value_ = *made;
        is_made_ = true;
      }
    }
    made_or_given_up_.notify_all();
    return made;
  }

  /// Null until it is made. Does not wait.
  T* MadeOrNull() const { return is_made_ ? value_.get() : nullptr; }

 private:
  // How long a waiter sleeps between two looks at its own deadline.
  static constexpr std::chrono::milliseconds kWaitSlice{5};

  std::mutex mutex_;
  std::condition_variable made_or_given_up_;
  bool is_being_made_ = false;
  // Not changed once `is_made_` is set.
  std::shared_ptr<T> value_;
  std::atomic<bool> is_made_ = false;
};

}  // namespace dsg::query
