// SPDX-License-Identifier: Apache-2.0
// Which calls are made again, when, and for how long: a few times for people who wait for an
// answer, for minutes for a log that must arrive; and what people are told meanwhile.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "query/api/call_context.h"
#include "schema/base/random.h"
#include "schema/base/time.h"

namespace dsg::client {

/// Gets one sentence; called from any thread, one at a time.
using TellWait = std::function<void(const std::string&)>;

/// Tells people that a call waits for a server, why, and how much longer it will. Says nothing
/// about calls that are answered soon.
///
/// Threads: one caller at a time; a thread of its own speaks while a call hangs.
class WaitNotes {
 public:
  using Clock = std::chrono::steady_clock;

  /// What is said when. Tests make it shorter.
  struct Pace {
    /// An unanswered call is spoken of after so long; a failed one at once.
    std::chrono::milliseconds silence_max = std::chrono::seconds(3);
    std::chrono::milliseconds repeat_every = std::chrono::seconds(5);
  };

  /// `tell` may be empty: then nothing is ever said.
  WaitNotes(std::string address, TellWait tell);
  WaitNotes(std::string address, TellWait tell, const Pace& pace);
  ~WaitNotes();
  WaitNotes(const WaitNotes&) = delete;
  WaitNotes& operator=(const WaitNotes&) = delete;

  /// `give_up`: when the caller stops asking.
  void CallBegins(Clock::time_point give_up);
  /// `why`: what the transport or the server said.
  void AttemptFailed(const std::string& why);
  void CallEnds(bool is_answered);

 private:
  void Run();
  void SayWaiting(Clock::time_point now);

  const std::string address_;
  const TellWait tell_;
  const Pace pace_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopping_ = false;
  bool is_busy_ = false;
  bool has_spoken_ = false;
  Clock::time_point begin_;
  Clock::time_point give_up_;
  Clock::time_point speak_next_;
  std::string why_;
  std::thread thread_;
};

/// Runs `attempt` again after UNAVAILABLE: at most 3 times more, within 2 s, never past the
/// deadline or a cancellation. For calls that change nothing.
absl::Status RetryRead(const query::CallContext& call,
                       const std::function<absl::Status()>& attempt);

/// Makes calls to one server, one after another, and repeats those that were not answered.
///
/// Threads: one caller at a time.
class PatientCaller {
 public:
  /// `retry_ns_max`: how long a call is repeated. `tell` may be empty.
  PatientCaller(std::string address, TimeNs retry_ns_max, TellWait tell);

  const std::string& address() const { return address_; }

  /// Runs `attempt` with a fresh context, which has its deadline, until it succeeds, fails for
  /// good, or the time is over. `attempt` asks an Api that repeats nothing itself
  /// (ServerAddress::repeats).
  /// Repeated are transport failures, attempts without an answer within a minute (longer with each
  /// repetition, for slow links), a server that is shutting down or overloaded, and a commit of
  /// unknown outcome; so the call must be idempotent. Pauses grow from 50 ms to 5 s, each drawn
  /// from half of that up, so that robots that were cut off together do not come back together.
  ///
  /// Errors: of the last attempt; UNAVAILABLE and DEADLINE_EXCEEDED name the address.
  absl::Status Call(const std::function<absl::Status(const query::CallContext&)>& attempt);

 private:
  absl::Status Repeat(const std::function<absl::Status(const query::CallContext&)>& attempt,
                      WaitNotes::Clock::time_point give_up);

  const std::string address_;
  const TimeNs retry_ns_max_;
  Random random_;
  WaitNotes notes_;
};

}  // namespace dsg::client
