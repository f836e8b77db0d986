// SPDX-License-Identifier: Apache-2.0
// Which pixel of one camera shows what a pixel of another camera at the same place shows.
// Refuses to blend: the nearest pixel is taken, for depths and labels have no mean.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// From the pixels of a target camera without distortion to those of a source camera. Their
/// centres count as one; sizes, focal lengths, distortion and direction may differ.
class PixelMap {
 public:
  /// Cost: target pixels.
  PixelMap(const CameraCalibration& target, const CameraCalibration& source);

  /// Index of the source pixel that shows target pixel `i` (both row by row); -1 = outside.
  int32_t operator[](size_t i) const {
    return source_of_.empty() ? static_cast<int32_t>(i) : source_of_[i];
  }
  /// Each pixel is its own source.
  bool IsIdentity() const { return source_of_.empty(); }
  size_t pixel_count() const { return pixel_count_; }

 private:
  size_t pixel_count_ = 0;
  std::vector<int32_t> source_of_;
};

}  // namespace dsg::ingest
