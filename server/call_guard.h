// SPDX-License-Identifier: Apache-2.0
// Ends calls that outlast their deadline or whose reader takes nothing for too long. gRPC ends only
// those whose caller gave a deadline, and no handler runs while a message waits for its reader.
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

/// One thread, which looks at each call when it may be due, so that a message costs two stores.
///
/// Threads: safe from any thread.
class CallGuard {
 public:
  using Clock = std::chrono::steady_clock;

  /// A guarded call, from its begin until OnDone.
  ///
  /// Threads: those of one call, in turn; verdict is safe from any.
  class Place {
   public:
    /// The call is no longer ended once this returns.
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

    /// A message is handed to gRPC, and taken from it by the reader.
    void BeginWrite() { write_began_.store(Clock::now().time_since_epoch().count()); }
    void EndWrite() { write_began_.store(kNoWrite); }
    /// Why the guard ended the call: DEADLINE_EXCEEDED, or RESOURCE_EXHAUSTED for a reader that
    /// took nothing; OK if it did not.
    absl::Status verdict() const;

   private:
    friend class CallGuard;
    enum class Verdict { kNone, kDeadline, kStall };
    static constexpr Clock::rep kNoWrite = Clock::duration::max().count();

    Place(CallGuard* guard, grpc_call* call, Clock::time_point deadline)
        : guard_(guard), call_(call), deadline_(deadline) {}
    /// When the reader has stalled for too long, the largest time point if nothing is written.
    Clock::time_point StallEnd() const;

    CallGuard* const guard_;
    grpc_call* const call_;
    const Clock::time_point deadline_;
    std::atomic<Clock::rep> write_began_{kNoWrite};
    std::atomic<Verdict> verdict_{Verdict::kNone};
    // When the guard looks next. Guarded by its mutex, as is where the place stands.
    Clock::time_point next_look_;
  };

  /// A reader that takes no message for `stall_max` is given up.
  explicit CallGuard(Clock::duration stall_max);
  ~CallGuard() { Stop(); }
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Begins to guard `call`, which must live as long as what is returned.
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
