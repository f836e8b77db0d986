// SPDX-License-Identifier: Apache-2.0
#include "server/worker_pool.h"

#include "schema/base/check.h"

namespace dsg::server {

WorkerPool::WorkerPool(int worker_count, int in_flight_max)
    : in_flight_max_(static_cast<size_t>(in_flight_max)) {
  DSG_CHECK(worker_count > 0 && in_flight_max > 0);
  for (int i = 0; i < worker_count; ++i) workers_.emplace_back([this] { Work(); });
}

bool WorkerPool::TrySubmit(Job* job) {
  {
    std::lock_guard lock(mutex_);
    if (stopped_ || queue_.size() + running_count_ >= in_flight_max_) return false;
    queue_.push_back(job);
  }
  wakeup_.notify_one();
  return true;
}

void WorkerPool::Resubmit(Job* job) {
  {
    std::lock_guard lock(mutex_);
    // Streams end before the pool does; a job lost here would be a call that never ends.
    DSG_CHECK(!stopped_);
    queue_.push_back(job);
  }
  wakeup_.notify_one();
}

void WorkerPool::Stop() {
  {
    std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  wakeup_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
}

void WorkerPool::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wakeup_.wait(lock, [this] { return stopped_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Job* job = queue_.front();
    queue_.pop_front();
    ++running_count_;
    lock.unlock();
    job->Run();
    lock.lock();
    --running_count_;
  }
}

}  // namespace dsg::server
