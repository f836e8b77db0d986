// SPDX-License-Identifier: Apache-2.0
#include "query/client/wait_notes.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

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

}  // namespace dsg::client
