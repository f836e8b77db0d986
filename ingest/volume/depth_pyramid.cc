// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/depth_pyramid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::ingest {
namespace {

constexpr int kTileShift = 3;

}  // namespace

DepthPyramid::DepthPyramid(const std::vector<float>& reach, int width, int height)
    : width_(width), height_(height) {
  constexpr int kTile = 1 << kTileShift;
  Level level{(width + kTile - 1) / kTile, (height + kTile - 1) / kTile, {}};
  level.max.assign(size_t{1} * level.width * level.height, 0.0f);
  for (int row = 0; row < height; ++row) {
    const float* pixel = &reach[size_t{1} * row * width];
    float* max = &level.max[size_t{1} * (row >> kTileShift) * level.width];
    for (int column = 0; column < width; ++column) {
      float& tile = max[column >> kTileShift];
      tile = std::max(tile, std::abs(pixel[column]));
    }
  }
  levels_.push_back(std::move(level));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& below = levels_.back();
    Level above{(below.width + 1) / 2, (below.height + 1) / 2, {}};
    above.max.assign(size_t{1} * above.width * above.height, 0.0f);
    for (int y = 0; y < below.height; ++y) {
      for (int x = 0; x < below.width; ++x) {
        float& tile = above.max[size_t{1} * (y / 2) * above.width + x / 2];
        tile = std::max(tile, below.max[size_t{1} * y * below.width + x]);
      }
    }
    levels_.push_back(std::move(above));
  }
}

float DepthPyramid::Max(int left, int top, int right, int bottom) const {
  left = std::max(left, 0);
  top = std::max(top, 0);
  right = std::min(right, width_ - 1);
  bottom = std::min(bottom, height_ - 1);
  if (left > right || top > bottom) return 0.0f;
  int shift = kTileShift;
  size_t at = 0;
  while (at + 1 < levels_.size() &&
         ((right >> shift) - (left >> shift) > 1 || (bottom >> shift) - (top >> shift) > 1)) {
    ++shift;
    ++at;
  }
  const Level& level = levels_[at];
  float max = 0.0f;
  for (int y = top >> shift; y <= bottom >> shift; ++y) {
    for (int x = left >> shift; x <= right >> shift; ++x) {
      max = std::max(max, level.max[size_t{1} * y * level.width + x]);
    }
  }
  return max;
}

}  // namespace dsg::ingest
