// SPDX-License-Identifier: Apache-2.0
// What long calls have: lines about their progress, and an end by Ctrl-C.
#pragma once

#include <chrono>
#include <csignal>
#include <functional>
#include <ostream>
#include <string>
#include <utility>

#include "query/cli/session.h"
#include "schema/base/status.h"

namespace dsg::cli {

/// Says on a stream for people how far a task is, once it has taken two seconds.
///
/// Threads: one caller.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;

  /// `now` is the clock, which tests replace.
  Progress(
      std::string task, std::ostream* out, Now now = [] { return Clock::now(); });

  /// `fraction` from 0 to 1. Writes a line with the time left at most every two seconds.
  void Update(double fraction);

 private:
  const std::string task_;
  std::ostream* const out_;
  const Now now_;
  const Clock::time_point start_;
  Clock::time_point last_line_;
};

/// While it lives, SIGINT and SIGTERM cancel `call`; a second one ends the program.
///
/// Threads: at most one of them in the process.
class InterruptGuard {
 public:
  /// `call` must outlive this.
  explicit InterruptGuard(query::CallContext* call);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

/// Reads the stream of a long call and gives each message to `take`. The messages' progress goes to
/// the session's notes; Ctrl-C cancels the call.
template <class Request, class Reply, class Take>
absl::Status ReadLong(Session* session, std::string task,
                      query::CursorOr<Reply> (query::Api::*method)(const query::CallContext&,
                                                                   const Request&),
                      const Request& request, const Take& take) {
  Progress progress(std::move(task), &session->notes());
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  return query::ReadStream(call, (session->api().*method)(call, request),
                           [&](const Reply& message) {
                             progress.Update(message.progress());
                             take(message);
                             return true;
                           });
}

}  // namespace dsg::cli
