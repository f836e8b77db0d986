// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/cancel_after.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <thread>

namespace dsg::test {
namespace {

// The processor time of a thread, not only of this one.
double ThreadMs(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

}  // namespace

Cancelled CancelAfter(const Ask& ask, query::ServiceCore* core, double delay_ms) {
  query::CallContext call;
  clockid_t clock = 0;
  pthread_getcpuclockid(pthread_self(), &clock);
  std::mutex mutex;
  std::condition_variable answered;
  bool is_answered = false;
  double cancelled_ms = 0.0;
  std::thread canceller([&] {
    std::unique_lock lock(mutex);
    const std::chrono::duration<double, std::milli> delay(delay_ms);
    answered.wait_for(lock, delay, [&] { return is_answered; });
    cancelled_ms = ThreadMs(clock);
    call.Cancel();
  });
  Cancelled cancelled;
  cancelled.status = ask(core, call);
  const double end_ms = ThreadMs(clock);
  {
    const std::lock_guard lock(mutex);
    is_answered = true;
  }
  answered.notify_all();
  canceller.join();
  cancelled.late_ms = std::max(0.0, end_ms - cancelled_ms);
  return cancelled;
}

}  // namespace dsg::test
