// SPDX-License-Identifier: Apache-2.0
// Ends calls that outlast their deadline or whose reader takes no message for too long. gRPC itself
// ends only calls whose caller set a deadline, and no handler runs while a message waits for its
// reader.
#pragma once

#include <chrono>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "server/end_call.h"
#include "server/timer.h"

namespace dsg::server {

/// The timer looks at each call when it may be due, so that a message costs only two atomic stores.
///
/// Threads: safe from any thread.
class CallGuard {
  // What the timer looks at; it may outlive the place.
  struct Watched;

 public:
  using Clock = Timer::Clock;

  /// Guards a call from its begin until it is over.
  ///
  /// Threads: one at a time; verdict is safe from any.
  class Place {
   public:
    /// After this the guard no longer ends the call.
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

    /// To be called when a message is handed over to be sent and when the reader has taken it.
    void BeginWrite();
    void EndWrite();
    /// The reader took a part of the message: its time begins anew. Safe from any thread.
    void Progress();
    /// Why the guard ended the call: DEADLINE_EXCEEDED, or RESOURCE_EXHAUSTED for a reader that
    /// took no message; OK if the guard did not end it.
    absl::Status verdict() const;

   private:
    friend class CallGuard;
    explicit Place(std::shared_ptr<Watched> watched) : watched_(std::move(watched)) {}

    const std::shared_ptr<Watched> watched_;
  };

  /// `timer` must outlive this. `stall_max`: a call ends when its reader takes no message for this
  /// long.
  CallGuard(Timer* timer, Clock::duration stall_max) : timer_(timer), stall_max_(stall_max) {}
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Begins to guard a call that `end` ends; it is called at most once, without a lock.
  std::unique_ptr<Place> Guard(EndCall end, Clock::time_point deadline);

 private:
  Timer* const timer_;
  const Clock::duration stall_max_;
};

}  // namespace dsg::server
