// SPDX-License-Identifier: Apache-2.0
#include "query/cli/progress.h"

#include <atomic>
#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"

namespace dsg::cli {
namespace {

constexpr std::chrono::seconds kLinePeriod{2};

// All that the handler touches: a lock-free pointer and the atomic flag behind it.
std::atomic<query::CallContext*> current_call{nullptr};
static_assert(std::atomic<query::CallContext*>::is_always_lock_free);

void CancelCurrentCall(int) {
  if (query::CallContext* call = current_call.load()) call->Cancel();
}

}  // namespace

Progress::Progress(std::string task, std::ostream* out, Now now)
    : task_(std::move(task)), out_(out), now_(std::move(now)), start_(now_()), last_line_(start_) {}

void Progress::Update(double fraction) {
  const Clock::time_point now = now_();
  if (now - last_line_ < kLinePeriod) return;
  last_line_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  *out_ << absl::StrFormat("%s: %.0f %%", task_, 100.0 * fraction);
  // With almost nothing done, the estimate would mislead.
  if (fraction >= 0.01) {
    *out_ << absl::StrFormat(", %.0f s left", std::ceil(elapsed_s * (1.0 - fraction) / fraction));
  }
  *out_ << std::endl;
}

InterruptGuard::InterruptGuard(query::CallContext* call) {
  current_call.store(call);
  struct sigaction action {};
  action.sa_handler = CancelCurrentCall;
  action.sa_flags = SA_RESETHAND;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
  current_call.store(nullptr);
}

}  // namespace dsg::cli
