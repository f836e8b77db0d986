// SPDX-License-Identifier: Apache-2.0
// Turns Ctrl-C into the end of a call, so that a watch stops in order.
// Refuses to catch it twice: the second one ends the program as ever.
#pragma once

#include <csignal>

#include "query/api/call_context.h"

namespace dsg::cli {

/// While it lives, SIGINT and SIGTERM cancel `call`.
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

}  // namespace dsg::cli
