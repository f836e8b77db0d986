// SPDX-License-Identifier: Apache-2.0
#include "server/worker_pool.h"

#include <sys/resource.h>

#include <algorithm>

#include "schema/base/check.h"

namespace dsg::server {

WorkerPool::WorkerPool(int worker_count, int in_flight_max, int niceness)
    : niceness_(niceness),
      in_flight_max_(static_cast<size_t>(in_flight_max)),
      stream_worker_max_(static_cast<size_t>(std::max(1, worker_count / 2))) {
  DSG_CHECK(worker_count > 0 && in_flight_max > 0);
  for (int i = 0; i < worker_count; ++i) {
    Seat* const seat = seats_.emplace_back(std::make_unique<Seat>()).get();
    workers_.emplace_back([this, seat] { Work(seat); });
  }
}

bool WorkerPool::TrySubmit(Job* job, JobKind kind) {
  Seat* called = nullptr;
  {
    std::lock_guard lock(mutex_);
    // The limit on open streams bounds their messages. These must not count as calls, or many
    // watches would shut out calls.
    const size_t call_count = calls_.size() + running_count_ - running_stream_count_;
    if (stopped_ || (kind == JobKind::kCall && call_count >= in_flight_max_)) return false;
    (kind == JobKind::kStream ? streams_ : calls_).push_back(job);
    if (HasWork()) called = CallOne();
  }
  // After the lock is released; otherwise the worker would wake only to wait for the lock.
  if (called != nullptr) called->wakeup.notify_one();
  return true;
}

void WorkerPool::Resubmit(Job* job) {
  Seat* called = nullptr;
  {
    std::lock_guard lock(mutex_);
    // Streams end before the pool stops; a call whose job is lost here would never end.
    DSG_CHECK(!stopped_);
    streams_.push_back(job);
    // Otherwise a worker takes it when it has finished another stream's message.
    if (MayTakeStream()) called = CallOne();
  }
  if (called != nullptr) called->wakeup.notify_one();
}

WorkerPool::Seat* WorkerPool::CallOne() {
  if (idle_.empty()) return nullptr;
  Seat* const seat = idle_.back();
  idle_.pop_back();
  seat->called = true;
  return seat;
}

WorkerPool::Counts WorkerPool::Load() const {
  std::lock_guard lock(mutex_);
  return {static_cast<int>(running_count_), static_cast<int>(calls_.size() + streams_.size())};
}

void WorkerPool::Stop() {
  {
    std::lock_guard lock(mutex_);
    stopped_ = true;
    while (!idle_.empty()) CallOne()->wakeup.notify_one();
  }
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
}

bool WorkerPool::MayTakeStream() const {
  return !streams_.empty() && (stopped_ || running_stream_count_ < stream_worker_max_);
}

JobKind WorkerPool::ChooseKind() {
  constexpr int kCallsInARowMax = 3;
  const bool may_take_stream = MayTakeStream();
  if (!calls_.empty() && (!may_take_stream || calls_in_a_row_ < kCallsInARowMax)) {
    calls_in_a_row_ = may_take_stream ? calls_in_a_row_ + 1 : 0;
    return JobKind::kCall;
  }
  calls_in_a_row_ = 0;
  return JobKind::kStream;
}

void WorkerPool::Work(Seat* seat) {
  // On Linux, 0 means the calling thread, not the process. A failure is harmless.
  if (niceness_ != 0) setpriority(PRIO_PROCESS, 0, niceness_);
  std::unique_lock lock(mutex_);
  while (true) {
    while (!stopped_ && !HasWork()) {
      idle_.push_back(seat);
      seat->wakeup.wait(lock, [seat] { return seat->called; });
      seat->called = false;
    }
    if (!HasWork()) return;
    const bool is_stream = ChooseKind() == JobKind::kStream;
    std::deque<Job*>& queue = is_stream ? streams_ : calls_;
    Job* job = queue.front();
    queue.pop_front();
    ++running_count_;
    if (is_stream) ++running_stream_count_;
    lock.unlock();
    job->Run();
    lock.lock();
    --running_count_;
    if (!is_stream) continue;
    --running_stream_count_;
    // This worker may take a call next, so wake another one for the waiting stream.
    if (calls_.empty() || !MayTakeStream()) continue;
    if (Seat* const called = CallOne(); called != nullptr) called->wakeup.notify_one();
  }
}

}  // namespace dsg::server
