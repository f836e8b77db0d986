// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "ingest/recognition/descriptor_match_internal.h"

namespace dsg::ingest {
namespace {

// The nearest one and how much the next one differs, bits.
struct NearestTwo {
  int index = -1;
  int bits = std::numeric_limits<int>::max();
  int next_bits = std::numeric_limits<int>::max();

  void Offer(int other, int other_bits) {
    if (other_bits < bits) {
      next_bits = bits;
      bits = other_bits;
      index = other;
    } else if (other_bits < next_bits) {
      next_bits = other_bits;
    }
  }
  bool IsClear(const PlaceVerifierOptions& options) const {
    return bits <= options.match_bits_max && bits < options.match_ratio * next_bits;
  }
};

cv::Mat DescriptorRows(const KeyframeFeatures& keyframe) {
  return {static_cast<int>(keyframe.descriptors.size()), static_cast<int>(sizeof(OrbDescriptor)),
          CV_8U, const_cast<OrbDescriptor*>(keyframe.descriptors.data())};
}

}  // namespace

cv::Mat1i BitsOfAllPairs(const KeyframeFeatures& from, const KeyframeFeatures& to) {
  if (from.descriptors.empty() || to.descriptors.empty()) return {};
  cv::Mat1i bits;
  cv::batchDistance(DescriptorRows(from), DescriptorRows(to), bits, CV_32S, cv::noArray(),
                    cv::NORM_HAMMING);
  return bits;
}

std::vector<FeatureMatch> MutualMatches(const cv::Mat1i& bits,
                                        const PlaceVerifierOptions& options) {
  std::vector<NearestTwo> of_from(static_cast<size_t>(bits.rows));
  std::vector<NearestTwo> of_to(static_cast<size_t>(bits.cols));
  for (int i = 0; i < bits.rows; ++i) {
    const int* const row = bits[i];
    NearestTwo& nearest = of_from[static_cast<size_t>(i)];
    for (int k = 0; k < bits.cols; ++k) {
      nearest.Offer(k, row[k]);
      of_to[static_cast<size_t>(k)].Offer(i, row[k]);
    }
  }
  std::vector<FeatureMatch> matches;
  for (int i = 0; i < bits.rows; ++i) {
    const NearestTwo& there = of_from[static_cast<size_t>(i)];
    const NearestTwo& back = of_to[static_cast<size_t>(there.index)];
    if (back.index != i || !there.IsClear(options) || !back.IsClear(options)) continue;
    matches.push_back({i, there.index});
  }
  return matches;
}

}  // namespace dsg::ingest
