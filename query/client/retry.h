// SPDX-License-Identifier: Apache-2.0
// Which calls are made again, when, and for how long: a few times for people who wait for an
// answer, for minutes for a log that must arrive.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "query/api/call_context.h"
#include "query/client/wait_notes.h"
#include "schema/base/random.h"
#include "schema/base/time.h"

namespace dsg::client {

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
