// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace dsg::ingest {
namespace {

constexpr int64_t kLookEvery = 1024;
constexpr std::chrono::milliseconds kTerminalPeriod(200);
constexpr std::chrono::milliseconds kPlainPeriod(2000);
constexpr int kBarWidth = 24;

}  // namespace

Progress::Progress(std::string what, int64_t total, bool is_quiet)
    : what_(std::move(what)),
      total_(total),
      is_quiet_(is_quiet),
      is_terminal_(isatty(STDERR_FILENO) == 1),
      begin_(Clock::now()),
      drawn_(begin_) {}

Progress::~Progress() {
  if (is_drawn_ && is_terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::Update(int64_t done) {
  if (is_quiet_ || done < next_look_) return;
  next_look_ = done + kLookEvery;
  const auto now = Clock::now();
  if (!IsDue(now)) return;
  Draw(FormatProgress(what_, done, total_, std::chrono::duration<double>(now - begin_).count()));
}

void Progress::Update(const std::string& step, int64_t done, int64_t total) {
  if (is_quiet_) return;
  const auto now = Clock::now();
  if (step != step_ || done < step_done_) {
    step_ = step;
    step_begin_ = now;
  }
  step_done_ = done;
  if (!IsDue(now)) return;
  const double elapsed_s = std::chrono::duration<double>(now - step_begin_).count();
  Draw(FormatProgress(step, done, total, elapsed_s));
}

bool Progress::IsDue(Clock::time_point now) {
  if (now - drawn_ < (is_terminal_ ? kTerminalPeriod : kPlainPeriod)) return false;
  drawn_ = now;
  return true;
}

void Progress::Draw(const std::string& line) {
  std::fprintf(stderr, is_terminal_ ? "\r%s\033[K" : "%s\n", line.c_str());
  std::fflush(stderr);
  is_drawn_ = true;
}

std::string FormatDuration(double seconds) {
  if (seconds < 60.0) return absl::StrFormat("%.1fs", seconds);
  const auto whole = static_cast<int64_t>(seconds);
  return absl::StrFormat("%dm%02ds", whole / 60, whole % 60);
}

std::string FormatProgress(const std::string& what, int64_t done, int64_t total, double elapsed_s) {
  const double rate = elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
  const std::string speed = absl::StrFormat("%.0f/s", rate);
  if (total <= 0) return absl::StrCat(what, " ", done, ", ", speed);
  const double fraction =
      std::clamp(static_cast<double>(done) / static_cast<double>(total), 0.0, 1.0);
  const int filled = static_cast<int>(fraction * kBarWidth);
  const std::string left =
      rate > 0.0 ? FormatDuration(static_cast<double>(std::max<int64_t>(total - done, 0)) / rate)
                 : "?";
  return absl::StrCat("[", std::string(static_cast<size_t>(filled), '#'),
                      std::string(static_cast<size_t>(kBarWidth - filled), '.'), "] ",
                      absl::StrFormat("%.0f", 100.0 * fraction), " % ", what, " ", done, " of ",
                      total, ", ", speed, ", ", left, " left");
}

}  // namespace dsg::ingest
