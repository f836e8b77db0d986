// SPDX-License-Identifier: Apache-2.0
// Jobs that wait for a point in time; the timer hands them back to the workers when they are due.
#pragma once

#include <mutex>
#include <unordered_map>

#include "server/timer.h"
#include "server/worker_pool.h"

namespace dsg::server {

/// Threads: safe from any thread.
class DelayQueue {
 public:
  /// Both must outlive the jobs that wait here; the timer must be stopped before this is destroyed.
  DelayQueue(Timer* timer, WorkerPool* workers) : timer_(timer), workers_(workers) {}

  DelayQueue(const DelayQueue&) = delete;
  DelayQueue& operator=(const DelayQueue&) = delete;

  /// Runs a job on a worker at `due`, or at once after HurryAll. The job must not be waiting here,
  /// and must have been submitted to the pool before; see WorkerPool::Resubmit.
  void Add(Job* job, Timer::Clock::time_point due);
  /// Runs a job at once if it waits here; otherwise does nothing.
  ///
  /// Cost: logarithmic in the number of waiting jobs.
  void Hurry(Job* job);
  /// Runs all waiting jobs at once, and later ones without delay.
  void HurryAll();

 private:
  // What the alarm of a job does.
  void EndWait(Job* job);

  Timer* const timer_;
  WorkerPool* const workers_;
  std::mutex mutex_;
  // With the alarm of each.
  std::unordered_map<Job*, Timer::Handle> waiting_;
  bool hurried_ = false;
};

}  // namespace dsg::server
