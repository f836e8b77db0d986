// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/cli/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace dsg::simulator {
namespace {

constexpr int kBarWidth = 30;

}  // namespace

ProgressLine::ProgressLine()
    : is_terminal_(isatty(STDERR_FILENO) != 0),
      next_(std::chrono::steady_clock::now() + std::chrono::seconds(2)) {}

ProgressLine::~ProgressLine() { Clear(); }

void ProgressLine::Show(const std::string& step, double share) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + (is_terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(5000));
  if (!is_terminal_) {
    std::fprintf(stderr, "%s %3.0f %%\n", step.c_str(), 100.0 * share);
    return;
  }
  const int filled = std::clamp(static_cast<int>(kBarWidth * share), 0, kBarWidth);
  const std::string bar = std::string(static_cast<size_t>(filled), '#') +
                          std::string(static_cast<size_t>(kBarWidth - filled), '.');
  Clear();
  std::fprintf(stderr, "[%s] %3.0f %%  %s", bar.c_str(), 100.0 * share, step.c_str());
  is_shown_ = true;
}

void ProgressLine::Clear() {
  if (is_shown_) std::fprintf(stderr, "\r\033[K");
  is_shown_ = false;
}

}  // namespace dsg::simulator
