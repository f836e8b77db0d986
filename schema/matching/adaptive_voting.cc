// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/adaptive_voting.h"

#include <algorithm>
#include <cstddef>

namespace dsg {
namespace {

struct IntervalEnd {
  double position;
  // Beginnings first, so that intervals that touch overlap.
  bool is_end;
  int measurement;

  bool operator<(const IntervalEnd& other) const {
    if (position != other.position) return position < other.position;
    if (is_end != other.is_end) return other.is_end;
    return measurement < other.measurement;
  }
};

std::vector<IntervalEnd> SortedEnds(const std::vector<Measurement>& measurements) {
  std::vector<IntervalEnd> ends;
  ends.reserve(measurements.size() * 2);
  for (size_t i = 0; i < measurements.size(); ++i) {
    const Measurement& m = measurements[i];
    ends.push_back({m.value - m.bound, false, static_cast<int>(i)});
    ends.push_back({m.value + m.bound, true, static_cast<int>(i)});
  }
  std::sort(ends.begin(), ends.end());
  return ends;
}

// Weighted sums over the measurements whose intervals hold the present position.
class Consensus {
 public:
  // Values are taken from `origin`, so that squares of large values do not drown small spreads.
  Consensus(double origin, size_t total_count) : origin_(origin), outside_count_(total_count) {}

  void Add(const Measurement& m, double sign) {
    const double weight = sign / (m.bound * m.bound);
    const double value = m.value - origin_;
    weight_ += weight;
    first_ += weight * value;
    second_ += weight * value * value;
    if (sign > 0.0) {
      --outside_count_;
      ++inside_count_;
    } else {
      ++outside_count_;
      --inside_count_;
    }
  }
  bool IsEmpty() const { return inside_count_ == 0; }
  Vote Best() const {
    const double mean = first_ / weight_;
    const double inside = std::max(0.0, second_ - first_ * mean);
    return {origin_ + mean, inside + static_cast<double>(outside_count_)};
  }

 private:
  double origin_;
  size_t outside_count_;
  size_t inside_count_ = 0;
  double weight_ = 0.0;
  double first_ = 0.0;
  double second_ = 0.0;
};

}  // namespace

Vote VoteAdaptively(const std::vector<Measurement>& measurements) {
  Vote best;
  if (measurements.empty()) return best;
  const std::vector<IntervalEnd> ends = SortedEnds(measurements);
  Consensus consensus(ends[ends.size() / 2].position, measurements.size());
  bool is_first = true;
  for (const IntervalEnd& end : ends) {
    consensus.Add(measurements[end.measurement], end.is_end ? -1.0 : 1.0);
    if (consensus.IsEmpty()) continue;
    const Vote vote = consensus.Best();
    if (is_first || vote.cost < best.cost) best = vote;
    is_first = false;
  }
  return best;
}

}  // namespace dsg
