// SPDX-License-Identifier: Apache-2.0
// The threads that answer calls. gRPC's own threads are few and must not block, so handlers only
// put jobs here; what would have to wait too long is refused at once instead of queued.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace dsg::server {

/// Something to do on a worker. Owned by itself: nothing touches it after Run.
class Job {
 public:
  virtual void Run() = 0;

 protected:
  ~Job() = default;
};

/// Threads: safe from any thread.
class WorkerPool {
 public:
  /// At most `in_flight_max` jobs are queued and running at a time.
  WorkerPool(int worker_count, int in_flight_max);
  ~WorkerPool() { Stop(); }

  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// False when the pool is full or stopped; the job is then not run.
  [[nodiscard]] bool TrySubmit(Job* job);

  /// For a job that was submitted before and has more to do, such as a stream whose reader is ready
  /// again. Never refused: what has been begun is finished first. Requires: not stopped.
  void Resubmit(Job* job);

  /// Runs what is queued and joins the workers. Further calls do nothing.
  void Stop();

 private:
  void Work();

  const size_t in_flight_max_;
  std::mutex mutex_;
  std::condition_variable wakeup_;
  std::deque<Job*> queue_;
  size_t running_count_ = 0;
  bool stopped_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace dsg::server
