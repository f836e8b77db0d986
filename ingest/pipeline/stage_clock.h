// SPDX-License-Identifier: Apache-2.0
// How long each stage has taken, for people; never part of a result.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace dsg::ingest {

/// Threads: one caller at a time.
class StageClock {
 public:
  struct Time {
    int64_t count = 0;
    double total_s = 0.0;
    double longest_s = 0.0;
  };

  /// Counts from here to its destruction.
  class Span {
   public:
    Span(StageClock* clock, std::string stage)
        : clock_(clock), stage_(std::move(stage)), begin_(std::chrono::steady_clock::now()) {}
    ~Span() {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
      Time& time = clock_->times_[stage_];
      ++time.count;
      time.total_s += elapsed.count();
      time.longest_s = std::max(time.longest_s, elapsed.count());
    }
    Span(const Span&) = delete;
    Span& operator=(const Span&) = delete;

   private:
    StageClock* clock_;
    std::string stage_;
    std::chrono::steady_clock::time_point begin_;
  };

  /// By stage.
  const std::map<std::string, Time>& times() const { return times_; }

 private:
  std::map<std::string, Time> times_;
};

}  // namespace dsg::ingest
