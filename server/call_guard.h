// SPDX-License-Identifier: Apache-2.0
// Ends calls that outlast their deadline or whose reader takes no message for too long. gRPC itself
// ends only calls whose caller set a deadline, and no handler runs while a message waits for its
// reader.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "absl/status/status.h"

struct grpc_call;

namespace dsg::server {

/// One thread looks at each call when it may be due, so that a message costs only two atomic
/// stores.
///
/// Threads: safe from any thread.
class CallGuard {
 public:
  using Clock = std::chrono::steady_clock;

  /// Guards a call from its begin until OnDone.
  ///
  /// Threads: one at a time; verdict is safe from any.
  class Place {
   public:
    /// After this the guard no longer ends the call.
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

    /// To be called when a message is handed to gRPC and when the reader has taken it.
    void BeginWrite() { write_began_.store(Clock::now().time_since_epoch().count()); }
    void EndWrite() { write_began_.store(kNoWrite); }
    /// Why the guard ended the call: DEADLINE_EXCEEDED, or RESOURCE_EXHAUSTED for a reader that
    /// took no message; OK if the guard did not end it.
    absl::Status verdict() const;

   private:
    friend class CallGuard;
    enum class Verdict { kNone, kDeadline, kStall };
    static constexpr Clock::rep kNoWrite = Clock::duration::max().count();

    Place(CallGuard* guard, grpc_call* call, Clock::time_point deadline)
        : guard_(guard), call_(call), deadline_(deadline) {}
    /// When the reader will have stalled for too long; the largest time point if no write is open.
    Clock::time_point StallEnd() const;

    CallGuard* const guard_;
    grpc_call* const call_;
    const Clock::time_point deadline_;
    std::atomic<Clock::rep> write_began_{kNoWrite};
    std::atomic<Verdict> verdict_{Verdict::kNone};
    // When the guard looks next. Guarded by the guard's mutex.
    Clock::time_point next_look_;
  };

  /// `stall_max`: a call ends when its reader takes no message for this long.
  explicit CallGuard(Clock::duration stall_max);
  ~CallGuard() { Stop(); }
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Begins to guard `call`, which must outlive the returned place.
  std::unique_ptr<Place> Guard(grpc_call* call, Clock::time_point deadline);

  /// Joins the thread. Further calls do nothing. Requires: no places.
  void Stop();

 private:
  void Run();
  void LookAt(Place* place, std::unique_lock<std::mutex>* lock);
  void Insert(Place* place);
  void Remove(Place* place);

  const Clock::duration stall_max_;
  std::mutex mutex_;
  std::condition_variable wakeup_;
  std::multimap<Clock::time_point, Place*> looks_;
  int place_count_ = 0;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace dsg::server
