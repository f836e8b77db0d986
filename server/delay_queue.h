// SPDX-License-Identifier: Apache-2.0
// Jobs that wait for a point in time. One thread hands them back to the workers when they are due,
// however many wait.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "server/worker_pool.h"

namespace dsg::server {

/// Threads: safe from any thread.
class DelayQueue {
 public:
  using Clock = std::chrono::steady_clock;

  /// `workers` must outlive this.
  explicit DelayQueue(WorkerPool* workers);
  ~DelayQueue() { Stop(); }

  DelayQueue(const DelayQueue&) = delete;
  DelayQueue& operator=(const DelayQueue&) = delete;

  /// Runs a job on a worker at `due`, or at once after HurryAll. The job must have been submitted
  /// to the pool before; see WorkerPool::Resubmit.
  void Add(Job* job, Clock::time_point due);
  /// Runs a job at once if it waits here; otherwise does nothing.
  void Hurry(Job* job);
  /// Runs all waiting jobs at once, and later ones without delay.
  void HurryAll();
  /// Joins the thread. Further calls do nothing. Requires: no waiting jobs.
  void Stop();

 private:
  void Run();

  WorkerPool* workers_;
  std::mutex mutex_;
  std::condition_variable wakeup_;
  std::multimap<Clock::time_point, Job*> waiting_;
  bool hurried_ = false;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace dsg::server
