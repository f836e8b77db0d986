// SPDX-License-Identifier: Apache-2.0
// Callbacks that run at a point in time. One thread serves all waits of the server, however many
// there are.
#pragma once

#include <chrono>
#include <compare>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

namespace dsg::server {

/// Callbacks run one after another, so they must be short and must not wait. They run without a
/// lock of the timer and may call it.
///
/// Threads: safe from any thread, except Stop and the destructor, which callbacks must not call.
class Timer {
 public:
  using Clock = std::chrono::steady_clock;
  using Callback = std::function<void()>;

  /// Names one callback; never given twice.
  struct Handle {
    Clock::time_point due;
    /// Order among callbacks of one instant; 0 in a handle that names nothing.
    uint64_t number = 0;

    friend auto operator<=>(const Handle&, const Handle&) = default;
  };

  Timer() : thread_([this] { Run(); }) {}
  ~Timer() { Stop(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  /// Runs `callback` at `due` or soon after. Callbacks of one instant run in the order in which
  /// they came. Requires: not stopped.
  ///
  /// Cost: logarithmic in the number of waiting callbacks, as is Cancel.
  Handle At(Clock::time_point due, Callback callback);
  /// Forgets a callback. False if it has begun to run (it may be running still), or if it was
  /// cancelled before.
  bool Cancel(const Handle& handle);
  /// Joins the thread. Further calls do nothing. Requires: no waiting callbacks.
  void Stop();

 private:
  void Run();

  std::mutex mutex_;
  std::condition_variable wakeup_;
  std::map<Handle, Callback> waiting_;
  uint64_t last_number_ = 0;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace dsg::server
