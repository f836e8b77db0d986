// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/consensus.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

// No search draws as many: no option.
constexpr double kSampleCountMax = 1e9;

}  // namespace

int SampleCountFor(double agree_share, int sample_size, double probability) {
  const double all_right = std::pow(std::clamp(agree_share, 0.0, 1.0), sample_size);
  // log1p(-1) is minus infinity, which gives zero samples; log1p(-0) is zero, which gives infinity.
  const double count = std::ceil(std::log1p(-probability) / std::log1p(-all_right));
  return static_cast<int>(std::clamp(count, 1.0, kSampleCountMax));
}

SampleDraws::SampleDraws(int point_count, int sample_size, const ConsensusOptions& options)
    : options_(options),
      sample_size_(static_cast<size_t>(sample_size)),
      random_(static_cast<uint64_t>(options.seed), 0),
      order_(static_cast<size_t>(point_count)),
      needed_count_(options.draw_count_max) {
  DSG_CHECK(0 < sample_size && sample_size <= point_count);
  std::iota(order_.begin(), order_.end(), 0);
}

std::span<const int> SampleDraws::Next() {
  if (drawn_count_ >= needed_count_) return {};
  ++drawn_count_;
  for (size_t i = 0; i < sample_size_; ++i) {
    const int behind = random_.Index(static_cast<int>(order_.size() - i));
    std::swap(order_[i], order_[i + static_cast<size_t>(behind)]);
  }
  return std::span(order_).first(sample_size_);
}

void SampleDraws::NoteAgreement(int agree_count) {
  const double share = static_cast<double>(agree_count) / static_cast<double>(order_.size());
  const int count = SampleCountFor(share, static_cast<int>(sample_size_), options_.probability);
  needed_count_ = std::min(options_.draw_count_max, std::max(options_.draw_count_min, count));
}

bool IsConsensus(int agree_count, int point_count, const ConsensusOptions& options) {
  return agree_count >= options.agree_count_min &&
         agree_count >= options.agree_share_min * point_count;
}

}  // namespace dsg::ingest
