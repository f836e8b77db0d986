// SPDX-License-Identifier: Apache-2.0
#include "server/delay_queue.h"

#include <vector>

#include "schema/base/check.h"

namespace dsg::server {

void DelayQueue::Add(Job* job, Timer::Clock::time_point due) {
  {
    std::lock_guard lock(mutex_);
    if (!hurried_) {
      const Timer::Handle alarm = timer_->At(due, [this, job] { EndWait(job); });
      const bool is_new = waiting_.emplace(job, alarm).second;
      DSG_CHECK(is_new);
      return;
    }
  }
  workers_->Resubmit(job);
}

void DelayQueue::EndWait(Job* job) {
  {
    std::lock_guard lock(mutex_);
    waiting_.erase(job);
  }
  workers_->Resubmit(job);
}

// The wait of a job is ended by its alarm or by who cancels the alarm, never by both. An alarm that
// cannot be cancelled has gone off, and EndWait is about to run.

void DelayQueue::Hurry(Job* job) {
  {
    std::lock_guard lock(mutex_);
    const auto found = waiting_.find(job);
    if (found == waiting_.end() || !timer_->Cancel(found->second)) return;
    waiting_.erase(found);
  }
  workers_->Resubmit(job);
}

void DelayQueue::HurryAll() {
  std::vector<Job*> hurried;
  {
    std::lock_guard lock(mutex_);
    hurried_ = true;
    for (const auto& [job, alarm] : waiting_) {
      if (timer_->Cancel(alarm)) hurried.push_back(job);
    }
    for (Job* const job : hurried) waiting_.erase(job);
  }
  for (Job* const job : hurried) workers_->Resubmit(job);
}

}  // namespace dsg::server
