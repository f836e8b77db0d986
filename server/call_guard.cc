// SPDX-License-Identifier: Apache-2.0
#include "server/call_guard.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "grpc/grpc.h"
#include "schema/base/check.h"

namespace dsg::server {

CallGuard::Place::~Place() { guard_->Remove(this); }

CallGuard::Clock::time_point CallGuard::Place::StallEnd() const {
  const Clock::rep began = write_began_.load();
  if (began == kNoWrite) return Clock::time_point::max();
  return Clock::time_point(Clock::duration(began)) + guard_->stall_max_;
}

absl::Status CallGuard::Place::verdict() const {
  switch (verdict_.load()) {
    case Verdict::kNone:
      return absl::OkStatus();
    case Verdict::kDeadline:
      return absl::DeadlineExceededError(
          "the call took longer than its deadline, or than the server lets a call take");
    case Verdict::kStall:
      break;
  }
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(guard_->stall_max_).count();
  return absl::ResourceExhaustedError(absl::StrCat(
      "the reader took no message of the stream for ", ms,
      " ms; ask again from where it ended, and read what is sent at once or ask for less"));
}

CallGuard::CallGuard(Clock::duration stall_max)
    : stall_max_(stall_max), thread_([this] { Run(); }) {}

std::unique_ptr<CallGuard::Place> CallGuard::Guard(grpc_call* call, Clock::time_point deadline) {
  std::unique_ptr<Place> place(new Place(this, call, deadline));
  // No write can be overdue before that.
  place->next_look_ = std::min(deadline, Clock::now() + stall_max_);
  std::lock_guard lock(mutex_);
  DSG_CHECK(!stopped_);
  ++place_count_;
  Insert(place.get());
  return place;
}

void CallGuard::Insert(Place* place) {
  const auto at = looks_.emplace(place->next_look_, place);
  // Only the earliest entry determines how long the thread sleeps.
  if (at == looks_.begin()) wakeup_.notify_one();
}

void CallGuard::Remove(Place* place) {
  std::lock_guard lock(mutex_);
  --place_count_;
  const auto [begin, end] = looks_.equal_range(place->next_look_);
  const auto found =
      std::find_if(begin, end, [place](const auto& entry) { return entry.second == place; });
  if (found != end) looks_.erase(found);
}

void CallGuard::Stop() {
  {
    std::lock_guard lock(mutex_);
    if (stopped_) return;
    DSG_CHECK(place_count_ == 0);
    stopped_ = true;
  }
  wakeup_.notify_one();
  thread_.join();
}

void CallGuard::Run() {
  std::unique_lock lock(mutex_);
  while (!stopped_) {
    if (looks_.empty()) {
      wakeup_.wait(lock);
    } else if (const auto next = looks_.begin()->first; next > Clock::now()) {
      wakeup_.wait_until(lock, next);
    } else {
      Place* const place = looks_.begin()->second;
      looks_.erase(looks_.begin());
      LookAt(place, &lock);
    }
  }
}

void CallGuard::LookAt(Place* place, std::unique_lock<std::mutex>* lock) {
  const auto now = Clock::now();
  const auto stall_end = place->StallEnd();
  if (const auto due = std::min(place->deadline_, stall_end); due > now) {
    // A write that begins after this look cannot be overdue before the next look.
    place->next_look_ = std::min(due, now + stall_max_);
    Insert(place);
    return;
  }
  place->verdict_ = place->deadline_ <= now ? Place::Verdict::kDeadline : Place::Verdict::kStall;
  const absl::Status verdict = place->verdict();
  // Cancelling a call may run OnDone of its reactor in this thread, and with it the destructor of
  // its place, which takes the lock. The reference keeps the call alive until then.
  grpc_call* const call = place->call_;
  grpc_call_ref(call);
  lock->unlock();
  grpc_call_cancel_with_status(call, static_cast<grpc_status_code>(verdict.code()),
                               std::string(verdict.message()).c_str(), nullptr);
  grpc_call_unref(call);
  lock->lock();
}

}  // namespace dsg::server
