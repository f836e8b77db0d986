// SPDX-License-Identifier: Apache-2.0
#include "server/delay_queue.h"

#include <algorithm>

#include "schema/base/check.h"

namespace dsg::server {

DelayQueue::DelayQueue(WorkerPool* workers) : workers_(workers), thread_([this] { Run(); }) {}

void DelayQueue::Add(Job* job, Clock::time_point due) {
  {
    std::lock_guard lock(mutex_);
    if (!hurried_) {
      const auto at = waiting_.emplace(due, job);
      // Only the earliest job determines how long the thread sleeps.
      if (at != waiting_.begin()) return;
      wakeup_.notify_one();
      return;
    }
  }
  workers_->Resubmit(job);
}

void DelayQueue::Hurry(Job* job) {
  {
    std::lock_guard lock(mutex_);
    const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                    [job](const auto& entry) { return entry.second == job; });
    if (found == waiting_.end()) return;
    waiting_.erase(found);
  }
  workers_->Resubmit(job);
}

void DelayQueue::HurryAll() {
  std::multimap<Clock::time_point, Job*> waiting;
  {
    std::lock_guard lock(mutex_);
    hurried_ = true;
    waiting.swap(waiting_);
  }
  for (const auto& [due, job] : waiting) workers_->Resubmit(job);
}

void DelayQueue::Stop() {
  {
    std::lock_guard lock(mutex_);
    if (stopped_) return;
    // A call whose job is lost here would never end.
    DSG_CHECK(waiting_.empty());
    stopped_ = true;
  }
  wakeup_.notify_one();
  thread_.join();
}

void DelayQueue::Run() {
  std::unique_lock lock(mutex_);
  while (!stopped_) {
    if (waiting_.empty()) {
      wakeup_.wait(lock);
    } else if (const auto due = waiting_.begin()->first; due > Clock::now()) {
      wakeup_.wait_until(lock, due);
    } else {
      Job* const job = waiting_.begin()->second;
      waiting_.erase(waiting_.begin());
      workers_->Resubmit(job);
    }
  }
}

}  // namespace dsg::server
