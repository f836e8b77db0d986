// SPDX-License-Identifier: Apache-2.0
#include "tests/crash/visibility.h"

#include <algorithm>

#include "absl/strings/str_format.h"

namespace dsg::test {

void LookLog::Add(int64_t begin_ns, int64_t end_ns, int64_t revision) {
  ++look_count_;
  if (sights_.empty() || sights_.back().revision != revision) {
    sights_.push_back({revision, end_ns, begin_ns});
  }
  sights_.back().last_begin_ns = begin_ns;
}

LookLog::Result LookLog::Compare(const std::vector<Acknowledgement>& acknowledged,
                                 int64_t limit_ns) const {
  Result result;
  std::vector<double> delays_ms;
  for (const Acknowledgement& ack : acknowledged) {
    const auto first = std::lower_bound(
        sights_.begin(), sights_.end(), ack.revision,
        [](const Sight& sight, int64_t revision) { return sight.revision < revision; });
    // What the sight before was still seen for, after the revision was there.
    if (first != sights_.begin() && (first - 1)->last_begin_ns - ack.steady_ns > limit_ns) {
      ++result.late_count;
    }
    if (first == sights_.end()) continue;
    const int64_t delay_ns = std::max<int64_t>(first->first_end_ns - ack.steady_ns, 0);
    delays_ms.push_back(static_cast<double>(delay_ns) * 1e-6);
  }
  result.seen_count = static_cast<int64_t>(delays_ms.size());
  if (delays_ms.empty()) return result;
  std::sort(delays_ms.begin(), delays_ms.end());
  result.p99_ms = delays_ms[(delays_ms.size() - 1) * 99 / 100];
  result.max_ms = delays_ms.back();
  return result;
}

std::vector<Acknowledgement> LookLog::FirstSights() const {
  std::vector<Acknowledgement> sights;
  for (const Sight& sight : sights_) sights.push_back({sight.revision, sight.first_end_ns});
  return sights;
}

std::string LookLog::Result::Text(const std::string& what) const {
  return absl::StrFormat("%s: %d revisions, seen after p99 %.1f ms, max %.1f ms; %d late", what,
                         seen_count, p99_ms, max_ms, late_count);
}

}  // namespace dsg::test
