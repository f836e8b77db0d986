// SPDX-License-Identifier: Apache-2.0
#include "server/call_guard.h"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "absl/strings/str_cat.h"

namespace dsg::server {

struct CallGuard::Watched : std::enable_shared_from_this<Watched> {
  enum class Verdict { kNone, kDeadline, kStall };
  static constexpr Clock::rep kNoWrite = Clock::duration::max().count();

  Watched(Timer* timer_in, Clock::duration stall_max_in, Clock::time_point deadline_in)
      : timer(timer_in), stall_max(stall_max_in), deadline(deadline_in) {}

  /// When the reader will have stalled for too long; the largest time point if no write is open.
  Clock::time_point StallEnd() const;
  /// Lets the timer look at the call at `due`, or earlier. Requires: mutex held.
  void LookAgain(Clock::time_point now, Clock::time_point due);
  /// Ends the call if it is due.
  void Look();
  absl::Status Reason() const;

  Timer* const timer;
  const Clock::duration stall_max;
  const Clock::time_point deadline;
  std::atomic<Clock::rep> write_began{kNoWrite};
  std::atomic<Verdict> verdict{Verdict::kNone};
  std::mutex mutex;
  // These are guarded by the mutex. Empty once the place has gone, and the call maybe with it.
  EndCall end;
  Timer::Handle alarm;
};

CallGuard::Clock::time_point CallGuard::Watched::StallEnd() const {
  const Clock::rep began = write_began.load();
  if (began == kNoWrite) return Clock::time_point::max();
  return Clock::time_point(Clock::duration(began)) + stall_max;
}

void CallGuard::Watched::LookAgain(Clock::time_point now, Clock::time_point due) {
  // A write that begins after this look cannot be overdue before the next look.
  alarm = timer->At(std::min(due, now + stall_max), [self = shared_from_this()] { self->Look(); });
}

void CallGuard::Watched::Look() {
  std::unique_lock lock(mutex);
  if (!end) return;
  const auto now = Clock::now();
  const auto stall_end = StallEnd();
  if (const auto due = std::min(deadline, stall_end); due > now) {
    LookAgain(now, due);
    return;
  }
  verdict = deadline <= now ? Verdict::kDeadline : Verdict::kStall;
  const absl::Status reason = Reason();
  // Ending a call may run the destructor of its place in this thread, which takes the lock.
  const EndCall taken = std::exchange(end, nullptr);
  lock.unlock();
  taken(reason);
}

absl::Status CallGuard::Watched::Reason() const {
  switch (verdict.load()) {
    case Verdict::kNone:
      return absl::OkStatus();
    case Verdict::kDeadline:
      return absl::DeadlineExceededError(
          "the call took longer than its deadline, or than the server lets a call take");
    case Verdict::kStall:
      break;
  }
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(stall_max).count();
  return absl::ResourceExhaustedError(absl::StrCat(
      "the reader took no message of the stream for ", ms,
      " ms; ask again from where it ended, and read what is sent at once or ask for less"));
}

std::unique_ptr<CallGuard::Place> CallGuard::Guard(EndCall end, Clock::time_point deadline) {
  auto watched = std::make_shared<Watched>(timer_, stall_max_, deadline);
  {
    std::lock_guard lock(watched->mutex);
    watched->end = std::move(end);
    watched->LookAgain(Clock::now(), deadline);
  }
  return std::unique_ptr<Place>(new Place(std::move(watched)));
}

CallGuard::Place::~Place() {
  // What it holds is freed after the lock.
  EndCall dropped;
  Timer::Handle alarm;
  {
    std::lock_guard lock(watched_->mutex);
    dropped = std::exchange(watched_->end, nullptr);
    alarm = watched_->alarm;
  }
  watched_->timer->Cancel(alarm);
}

void CallGuard::Place::BeginWrite() {
  watched_->write_began.store(Clock::now().time_since_epoch().count());
}

void CallGuard::Place::EndWrite() { watched_->write_began.store(Watched::kNoWrite); }

void CallGuard::Place::Progress() {
  Clock::rep began = watched_->write_began.load();
  if (began == Watched::kNoWrite) return;
  // Unless the write has ended meanwhile.
  watched_->write_began.compare_exchange_strong(began, Clock::now().time_since_epoch().count());
}

absl::Status CallGuard::Place::verdict() const { return watched_->Reason(); }

}  // namespace dsg::server
