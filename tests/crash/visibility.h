// SPDX-License-Identifier: Apache-2.0
// How soon is a revision seen by somebody who looks again and again?
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/crash/process.h"

namespace dsg::test {

/// A revision is visible at the latest this long after its acknowledgement.
inline constexpr int64_t kVisibleNs = 200'000'000;

/// Looks of one watcher, in the order of time.
///
/// Threads: one caller at a time.
class LookLog {
 public:
  /// A look that began and ended at these times saw `revision` as the newest.
  void Add(int64_t begin_ns, int64_t end_ns, int64_t revision);
  int64_t look_count() const { return look_count_; }

  /// Compares what was seen with when it was acknowledged.
  ///
  /// `late` counts revisions that a look did not see although it began more than `limit_ns` after
  /// the acknowledgement; a watcher that was kept from looking is not to blame for that.
  struct Result {
    int64_t seen_count = 0;
    int64_t late_count = 0;
    double p99_ms = 0.0;
    double max_ms = 0.0;
    std::string Text(const std::string& what) const;
  };
  Result Compare(const std::vector<Acknowledgement>& acknowledged, int64_t limit_ns) const;

  /// When each newest revision was first seen, as if the watcher had acknowledged it.
  std::vector<Acknowledgement> FirstSights() const;

 private:
  struct Sight {
    int64_t revision;
    int64_t first_end_ns;
    int64_t last_begin_ns;
  };
  std::vector<Sight> sights_;
  int64_t look_count_ = 0;
};

}  // namespace dsg::test
