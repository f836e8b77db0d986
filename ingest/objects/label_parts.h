// SPDX-License-Identifier: Apache-2.0
// The connected pieces of a label picture: pixels of one class and instance that touch.
// Refuses to look at depth.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

/// Pixels [begin, end) of a row.
struct PixelRun {
  int row = 0;
  int begin = 0;
  int end = 0;
};

struct LabelPart {
  /// class << 8 | instance.
  uint16_t label = 0;
  /// Of its runs.
  int pixel_count = 0;
  /// Ascending by row, then begin.
  std::vector<PixelRun> runs;
  /// Of its pixels, both ends included.
  int left = 0, right = 0, top = 0, bottom = 0;
  /// Pixels of the same class and instance (if it has one) in other, smaller parts.
  int scattered_count = 0;
};

/// Parts of at least `pixel_count_min` pixels whose class is among `class_ids` (ascending), by
/// eight neighbours. Of the parts of one instance the largest only: the rest is what an occlusion
/// has cut off, or a label that bled. Order: ascending by first pixel. Cost: one pass over the
/// picture.
std::vector<LabelPart> FindLabelParts(const DepthFrame& frame,
                                      const std::vector<int32_t>& class_ids, int pixel_count_min);

}  // namespace dsg::ingest
