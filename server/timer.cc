// SPDX-License-Identifier: Apache-2.0
#include "server/timer.h"

#include <utility>

#include "schema/base/check.h"

namespace dsg::server {

Timer::Handle Timer::At(Clock::time_point due, Callback callback) {
  std::lock_guard lock(mutex_);
  DSG_CHECK(!stopped_);
  const Handle handle{due, ++last_number_};
  const auto at = waiting_.emplace(handle, std::move(callback)).first;
  // Only the earliest callback determines how long the thread sleeps.
  if (at == waiting_.begin()) wakeup_.notify_one();
  return handle;
}

bool Timer::Cancel(const Handle& handle) {
  // Destroyed after the lock is released, since what a callback holds may call the timer.
  decltype(waiting_)::node_type cancelled;
  std::lock_guard lock(mutex_);
  cancelled = waiting_.extract(handle);
  return !cancelled.empty();
}

void Timer::Stop() {
  {
    std::lock_guard lock(mutex_);
    if (stopped_) return;
    // A call that waits for a callback which is lost here would never end.
    DSG_CHECK(waiting_.empty());
    stopped_ = true;
  }
  wakeup_.notify_one();
  thread_.join();
}

void Timer::Run() {
  std::unique_lock lock(mutex_);
  while (!stopped_) {
    if (waiting_.empty()) {
      wakeup_.wait(lock);
    } else if (const auto due = waiting_.begin()->first.due; due > Clock::now()) {
      wakeup_.wait_until(lock, due);
    } else {
      auto next = waiting_.extract(waiting_.begin());
      lock.unlock();
      next.mapped()();
      next = {};
      lock.lock();
    }
  }
}

}  // namespace dsg::server
