// SPDX-License-Identifier: Apache-2.0
// Says how far a long task is, on a stream for people, and only once it has become long.
#pragma once

#include <chrono>
#include <functional>
#include <ostream>
#include <string>

namespace dsg::cli {

/// Threads: one caller.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;

  /// `now` is the clock, given so that tests can move it.
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

}  // namespace dsg::cli
