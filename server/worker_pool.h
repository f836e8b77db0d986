// SPDX-License-Identifier: Apache-2.0
// The threads that answer calls. gRPC's own threads are few and must not block, so handlers only
// put jobs here; what would have to wait too long is refused at once instead of queued, and streams
// never take all of them.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
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

/// What a job belongs to. Messages of streams are long and many, calls short and waited for.
enum class JobKind { kCall, kStream };

/// Calls go before messages of streams, three to one when both wait, and no more than half of the
/// workers (one of one) are at streams.
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

  /// For a stream that was submitted before and has more to do, such as one whose reader is ready
  /// again. Never refused: what has been begun is finished. Requires: not stopped.
  void Resubmit(Job* job);

  Counts Load() const;

  /// Runs what is queued and joins the workers. Further calls do nothing.
  void Stop();

 private:
  // Where an idle worker waits to be called.
  struct Seat {
    std::condition_variable wakeup;
    bool called = false;
  };

  void Work(Seat* seat);
  // The rest needs the lock.
  // Takes a worker that is idle, to be notified without the lock; nullptr if there is none.
  Seat* CallOne();
  bool MayTakeStream() const;
  bool HasWork() const { return !calls_.empty() || MayTakeStream(); }
  // Requires: HasWork.
  JobKind ChooseKind();

  const int niceness_;
  const size_t in_flight_max_;
  const size_t stream_worker_max_;
  mutable std::mutex mutex_;
  // Whoever sat down last is called first: its stack and its part of the heap are still in the
  // caches, so that a lone caller is not served by all workers in turn.
  std::vector<Seat*> idle_;
  std::deque<Job*> calls_;
  std::deque<Job*> streams_;
  size_t running_count_ = 0;
  size_t running_stream_count_ = 0;
  // Calls taken while a stream waited.
  int calls_in_a_row_ = 0;
  bool stopped_ = false;
  std::vector<std::unique_ptr<Seat>> seats_;
  std::vector<std::thread> workers_;
};

}  // namespace dsg::server
