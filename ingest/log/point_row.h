// SPDX-License-Identifier: Apache-2.0
// The points of a lidar's scan as an image of one row, whatever file they come from.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Collects points; those with a coordinate that is not finite are left out.
class PointRow {
 public:
  explicit PointRow(size_t count_max) {
    image_.height = 1;
    image_.format = PixelFormat::kPoints32;
    image_.bytes.reserve(12 * count_max);
  }
  /// In the lidar's frame, metres.
  void Add(const std::array<float, 3>& xyz) {
    if (!std::all_of(xyz.begin(), xyz.end(), [](float x) { return std::isfinite(x); })) return;
    const auto* const bytes = reinterpret_cast<const uint8_t*>(xyz.data());
    image_.bytes.insert(image_.bytes.end(), bytes, bytes + sizeof(xyz));
    ++image_.width;
  }
  Image Take() { return std::move(image_); }

 private:
  Image image_;
};

}  // namespace dsg::ingest
