// SPDX-License-Identifier: Apache-2.0
// The threads that answer calls. gRPC's own threads are few and must not block, so handlers only
// submit jobs here. Calls above the limit are refused at once instead of queued, and streams never
// occupy all workers.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace dsg::server {

/// A piece of work. Owns itself: the pool does not touch it after Run.
class Job {
 public:
  virtual void Run() = 0;

 protected:
  ~Job() = default;
};

/// What a job belongs to. Messages of streams are many and long; calls are short and urgent.
enum class JobKind { kCall, kStream };

/// Calls have priority over messages of streams, three to one when both wait. At most half of the
/// workers (at least one) run streams.
///
/// Threads: safe from any thread.
class WorkerPool {
 public:
  struct Counts {
    int running = 0;
    int queued = 0;
  };

  /// At most `in_flight_max` calls are queued and running at a time. `niceness` (0 to 19, see
  /// setpriority(2)) lowers the workers' share of the processors while others want them.
  WorkerPool(int worker_count, int in_flight_max, int niceness = 0);
  ~WorkerPool() { Stop(); }

  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// False when the pool is full of calls or stopped; the job is then not run.
  [[nodiscard]] bool TrySubmit(Job* job, JobKind kind = JobKind::kCall);

  /// Continues a stream that was submitted before, for example when its reader is ready again.
  /// Never refused: a begun stream must be able to finish. Requires: not stopped.
  void Resubmit(Job* job);

  Counts Load() const;

  /// Runs the queued jobs and joins the workers. Further calls do nothing.
  void Stop();

 private:
  // An idle worker waits on its seat.
  struct Seat {
    std::condition_variable wakeup;
    bool called = false;
  };

  void Work(Seat* seat);
  // The functions below require mutex_ held.
  // Takes an idle worker, to be notified after the lock is released; nullptr if there is none.
  Seat* CallOne();
  bool MayTakeStream() const;
  bool HasWork() const { return !calls_.empty() || MayTakeStream(); }
  // Requires: HasWork.
  JobKind ChooseKind();

  const int niceness_;
  const size_t in_flight_max_;
  const size_t stream_worker_max_;
  mutable std::mutex mutex_;
  // The last idle worker is called first: its stack and heap are still in the caches, so a single
  // client is not served by all workers in turn.
  std::vector<Seat*> idle_;
  std::deque<Job*> calls_;
  std::deque<Job*> streams_;
  size_t running_count_ = 0;
  size_t running_stream_count_ = 0;
  // Calls taken in a row while a stream waited.
  int calls_in_a_row_ = 0;
  bool stopped_ = false;
  std::vector<std::unique_ptr<Seat>> seats_;
  std::vector<std::thread> workers_;
};

}  // namespace dsg::server
