// SPDX-License-Identifier: Apache-2.0
// How far any pixel of a rectangle of the image sees, at once.
// Refuses to be exact: the rectangle is widened to tiles.
#pragma once

#include <vector>

namespace dsg::ingest {

/// Maxima over squares of 8, 16, 32 ... pixels.
class DepthPyramid {
 public:
  /// `reach` has width x height numbers; their absolute values count.
  DepthPyramid(const std::vector<float>& reach, int width, int height);

  /// At least the largest number in columns [left, right] and rows [top, bottom]; 0 when the
  /// rectangle misses the image.
  float Max(int left, int top, int right, int bottom) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<float> max;
  };
  int width_;
  int height_;
  std::vector<Level> levels_;
};

}  // namespace dsg::ingest
