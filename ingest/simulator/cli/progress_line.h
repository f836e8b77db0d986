// SPDX-License-Identifier: Apache-2.0
// Says on stderr how far a long run has come; quiet for the first two seconds.
// Refuses to guess when it will end.
#pragma once

#include <chrono>
#include <string>

namespace dsg::simulator {

/// In place on a terminal; a line every five seconds otherwise.
/// Threads: one caller at a time.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();

  /// `share` from 0 to 1.
  void Show(const std::string& step, double share);

 private:
  void Clear();

  const bool is_terminal_;
  std::chrono::steady_clock::time_point next_;
  bool is_shown_ = false;
};

}  // namespace dsg::simulator
