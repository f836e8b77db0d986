// SPDX-License-Identifier: Apache-2.0
// Tells people on stderr how far a log is. Refuses to slow the work down: it looks at the clock
// once in a while only.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace dsg::ingest {

/// A bar that is drawn over while stderr is a terminal, a plain line every two seconds otherwise.
///
/// Threads: one caller at a time.
class Progress {
 public:
  /// `total` = 0: unknown. `is_quiet`: nothing is ever written.
  Progress(std::string what, int64_t total, bool is_quiet);
  /// Leaves the terminal's line to whoever writes next.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the total so far.
  void Update(int64_t done);
  /// Of work that stops the one above, a bar of its own: `done` of `total` pieces; 0 = unknown.
  void Update(const std::string& step, int64_t done, int64_t total);

 private:
  using Clock = std::chrono::steady_clock;
  bool IsDue(Clock::time_point now);
  void Draw(const std::string& line);

  std::string what_;
  int64_t total_;
  bool is_quiet_;
  bool is_terminal_;
  bool is_drawn_ = false;
  int64_t next_look_ = 0;
  Clock::time_point begin_;
  Clock::time_point drawn_;
  std::string step_;
  int64_t step_done_ = 0;
  Clock::time_point step_begin_;
};

/// "1m05s", "3.2s".
std::string FormatDuration(double seconds);

/// What a progress line says: "[#####.....] 50 % obsmat.txt 4454 of 8908, 12000/s, 0.4s left".
std::string FormatProgress(const std::string& what, int64_t done, int64_t total, double elapsed_s);

}  // namespace dsg::ingest
