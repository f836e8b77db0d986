// SPDX-License-Identifier: Apache-2.0
// Which corners of two keyframes look alike.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/core/hal/hal.hpp>
#include <vector>

#include "ingest/recognition/keyframe_features.h"

namespace dsg::ingest {

/// Bits in which two descriptors differ.
inline int BitsBetween(const OrbDescriptor& a, const OrbDescriptor& b) {
  return cv::hal::normHamming(a.data(), b.data(), static_cast<int>(sizeof(OrbDescriptor)));
}

/// Indices of features of both keyframes.
struct FeatureMatch {
  int from = 0;
  int to = 0;
};

/// BitsBetween each descriptor of `from` (rows) and each one of `to` (columns). Cost: the product
/// of both counts, 4 ms for 1000 each.
cv::Mat1i BitsOfAllPairs(const KeyframeFeatures& from, const KeyframeFeatures& to);

/// Features that are each other's nearest and clearly nearer than the next one, ascending by
/// `from`.
std::vector<FeatureMatch> MutualMatches(const cv::Mat1i& bits, const PlaceVerifierOptions& options);

}  // namespace dsg::ingest
