// SPDX-License-Identifier: Apache-2.0
#include "query/cli/interrupt.h"

#include <atomic>

namespace dsg::cli {
namespace {

// What the handler may touch: a lock-free pointer and the atomic flag behind it.
std::atomic<query::CallContext*> current_call{nullptr};
static_assert(std::atomic<query::CallContext*>::is_always_lock_free);

void CancelCurrentCall(int) {
  if (query::CallContext* call = current_call.load()) call->Cancel();
}

}  // namespace

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
