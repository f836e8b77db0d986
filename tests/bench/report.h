// SPDX-License-Identifier: Apache-2.0
// How a benchmark measures and what it prints: one line a figure, ours beside a rival's, the ratio
// and the target. Refuses to print a time without its 99th percentile.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace CLI {
class App;
}  // namespace CLI

namespace dsg::bench {

/// Nanoseconds that `work` takes.
template <typename Work>
int64_t NanosecondsOf(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  std::forward<Work>(work)();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() -
                                                              begin)
      .count();
}

/// Nanoseconds of processor time that this thread has used; what a busy machine does not stretch.
int64_t ThreadCpuNs();

/// The same of all threads of this process.
int64_t ProcessCpuNs();

/// Durations of one operation.
class Samples {
 public:
  void Add(int64_t ns) { ns_.push_back(ns); }
  void Append(const Samples& other) { ns_.insert(ns_.end(), other.ns_.begin(), other.ns_.end()); }
  size_t count() const { return ns_.size(); }
  /// By nearest rank, nanoseconds. Requires: 0 < fraction <= 1, at least one sample.
  double Percentile(double fraction) const;

 private:
  std::vector<int64_t> ns_;
};

/// One measured number, in the unit of its line.
struct Figure {
  double value = 0.0;
  /// Only of times: `value` is then the median.
  std::optional<double> p99;
};

Figure Microseconds(const Samples& samples);
Figure Milliseconds(const Samples& samples);

struct Rival {
  std::string name;
  Figure figure;
};

/// What a figure must reach.
struct Target {
  enum class Kind { kNone, kAtMost, kAtLeast, kRatioAtMost, kFasterAtLeast };
  Kind kind = Kind::kNone;
  double value = 0.0;
};

/// Prints the figures and remembers whether a target was missed.
class Report {
 public:
  /// "point lookup: ours 3.1 us (p99 9.0), rows 7.2 us (p99 21), ratio 0.43 (target <= 0.7) PASS".
  void Line(const std::string& what, const std::string& unit, const Figure& ours,
            const std::optional<Rival>& rival, const Target& target);
  /// A line that says on what something was measured.
  void Note(const std::string& text) const;

  int missed_count() const { return missed_count_; }

 private:
  int missed_count_ = 0;
};

/// Shows on stderr, with the time since the first call, that a long step is alive.
void ShowProgress(const std::string& text);

/// What every benchmark takes besides its own options.
struct CommonOptions {
  /// Exit code 1 when a target is missed.
  bool strict = false;
  /// Where stores are made; they are removed at the end.
  std::string folder;
};

/// Parses the arguments with `app`, runs, and returns the exit code: 0, 1 (a target is missed and
/// --strict is given), 2 (it did not run, or an answer was wrong).
int RunBenchmark(CLI::App* app, int argc, char** argv,
                 const std::function<absl::Status(const CommonOptions&, Report*)>& run);

}  // namespace dsg::bench
