// SPDX-License-Identifier: Apache-2.0
#include "query/client/retry.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::client {
namespace {

// Idle, the thread looks so often whether there is something to say: a wake-up of it for each call
// would cost more than it is worth.
constexpr std::chrono::milliseconds kLookEvery(500);

int64_t WholeSeconds(WaitNotes::Clock::duration span) {
  return std::max<int64_t>(0, std::chrono::round<std::chrono::seconds>(span).count());
}

}  // namespace

WaitNotes::WaitNotes(std::string address, TellWait tell)
    : WaitNotes(std::move(address), std::move(tell), Pace()) {}

WaitNotes::WaitNotes(std::string address, TellWait tell, const Pace& pace)
    : address_(std::move(address)), tell_(std::move(tell)), pace_(pace) {
  if (tell_) thread_ = std::thread([this] { Run(); });
}

WaitNotes::~WaitNotes() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void WaitNotes::CallBegins(Clock::time_point give_up) {
  const std::lock_guard lock(mutex_);
  is_busy_ = true;
  begin_ = Clock::now();
  give_up_ = give_up;
  speak_next_ = begin_ + pace_.silence_max;
  why_.clear();
}

void WaitNotes::AttemptFailed(const std::string& why) {
  const std::lock_guard lock(mutex_);
  why_ = why;
  if (!tell_ || has_spoken_) return;
  SayWaiting(Clock::now());
}

void WaitNotes::CallEnds(bool is_answered) {
  const std::lock_guard lock(mutex_);
  is_busy_ = false;
  if (tell_ && has_spoken_ && is_answered) {
    tell_(absl::StrCat("server ", address_, " answers again after ",
                       WholeSeconds(Clock::now() - begin_), " s"));
  }
  has_spoken_ = false;
}

void WaitNotes::SayWaiting(Clock::time_point now) {
  has_spoken_ = true;
  speak_next_ = now + pace_.repeat_every;
  const std::string why = why_.empty() ? "no answer yet" : why_;
  tell_(absl::StrCat("waiting for server ", address_, " since ", WholeSeconds(now - begin_), " s (",
                     why, "); the log waits too; trying for another ", WholeSeconds(give_up_ - now),
                     " s"));
}

void WaitNotes::Run() {
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    const Clock::time_point now = Clock::now();
    if (is_busy_ && now >= speak_next_) SayWaiting(now);
    changed_.wait_for(lock, std::min(kLookEvery, pace_.silence_max));
  }
}

namespace {

using query::CallContext;
using Clock = WaitNotes::Clock;
using std::chrono::milliseconds;

// Longer than any commit of 4 MiB takes on a slow disk; a slow link gets more with each attempt.
constexpr std::chrono::seconds kAttemptTimeout(60);
constexpr std::chrono::seconds kAttemptTimeoutMax(600);
constexpr std::array<milliseconds, 3> kReadPauses{milliseconds(100), milliseconds(300),
                                                  milliseconds(900)};
// How soon a cancellation is noticed.
constexpr milliseconds kPausePollPeriod(20);
constexpr milliseconds kFirstPause(50);
constexpr milliseconds kLongestPause(5000);
// What gRPC makes of a broken link is not always UNAVAILABLE; a bug of the server looks alike.
constexpr int kOddAnswersMax = 5;

enum class Outcome { kAnswered, kUnanswered, kOdd };

Outcome OutcomeOf(const absl::Status& status) {
  switch (ReasonOf(status)) {
    case Reason::kUnspecified:
      break;
    case Reason::kShuttingDown:
    case Reason::kCommitOutcomeUnknown:
    case Reason::kOverloaded:
      return Outcome::kUnanswered;
    default:
      return Outcome::kAnswered;
  }
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
    // We cancel nothing: a server that ends at once does.
    case absl::StatusCode::kCancelled:
      return Outcome::kUnanswered;
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
      return Outcome::kOdd;
    default:
      return Outcome::kAnswered;
  }
}

std::string Why(const absl::Status& status) {
  if (absl::IsDeadlineExceeded(status)) return "no answer to a call";
  return std::string(status.message());
}

// Robots that are started at the same moment must not draw the same pauses.
uint64_t SeedOfThisProcess() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<uint64_t>(now.count()) ^ (static_cast<uint64_t>(getpid()) << 40);
}

// False if the call must not be tried again.
bool Pause(const CallContext& call, milliseconds length) {
  const auto end = Clock::now() + length;
  if (end >= call.deadline()) return false;
  for (auto now = Clock::now(); now < end; now = Clock::now()) {
    if (call.cancelled()) return false;
    std::this_thread::sleep_for(std::min<Clock::duration>(kPausePollPeriod, end - now));
  }
  return !call.cancelled();
}

}  // namespace

absl::Status RetryRead(const CallContext& call, const std::function<absl::Status()>& attempt) {
  absl::Status status = attempt();
  for (const auto pause : kReadPauses) {
    if (!absl::IsUnavailable(status) || !Pause(call, pause)) break;
    status = attempt();
  }
  return status;
}

PatientCaller::PatientCaller(std::string address, TimeNs retry_ns_max, TellWait tell)
    : address_(std::move(address)),
      retry_ns_max_(retry_ns_max),
      random_(SeedOfThisProcess(), 0),
      notes_(address_, std::move(tell)) {}

absl::Status PatientCaller::Call(const std::function<absl::Status(const CallContext&)>& attempt) {
  const Clock::time_point give_up = Clock::now() + std::chrono::nanoseconds(retry_ns_max_);
  notes_.CallBegins(give_up);
  const absl::Status status = Repeat(attempt, give_up);
  notes_.CallEnds(status.ok());
  return status;
}

absl::Status PatientCaller::Repeat(const std::function<absl::Status(const CallContext&)>& attempt,
                                   Clock::time_point give_up) {
  milliseconds pause = kFirstPause;
  std::chrono::seconds timeout = kAttemptTimeout;
  int odd_count = 0;
  while (true) {
    const absl::Status status = attempt(CallContext(Clock::now() + timeout));
    const Outcome outcome = status.ok() ? Outcome::kAnswered : OutcomeOf(status);
    if (outcome == Outcome::kAnswered) return status;
    if (outcome == Outcome::kOdd && ++odd_count >= kOddAnswersMax) return status;
    if (absl::IsDeadlineExceeded(status)) timeout = std::min(2 * timeout, kAttemptTimeoutMax);
    const milliseconds drawn(
        static_cast<int64_t>(static_cast<double>(pause.count()) * random_.Uniform(0.5, 1.0)));
    if (Clock::now() + drawn > give_up) {
      return Annotate(
          status,
          absl::StrCat("server ", address_, " did not answer for ", retry_ns_max_ / kNsPerSecond,
                       " s; is dsg-server running there? What is committed is safe: "
                       "run the same again, and it goes on from there"));
    }
    notes_.AttemptFailed(Why(status));
    std::this_thread::sleep_for(drawn);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace dsg::client
