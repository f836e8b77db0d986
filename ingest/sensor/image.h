// SPDX-License-Identifier: Apache-2.0
// A picture in memory, of whatever a camera measures; plain bytes.
// Refuses to know files, codecs or libraries of computer vision.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

namespace dsg::ingest {

enum class PixelFormat {
  /// One byte, 0 = black.
  kGray8,
  /// Three bytes: red, green, blue.
  kRgb8,
  /// Two bytes, little endian: class << 8 | instance within the class, 0 = none of both.
  kLabel16,
  /// Two bytes, little endian: millimetres along the optical axis, 0 = no reading.
  kDepth16,
  /// Four bytes, IEEE float: metres along the optical axis, 0 or NaN = no reading.
  kDepth32,
  /// Twelve bytes, three IEEE floats: a point in the sensor's frame, x forward, y left, z up,
  /// metres; NaN = no reading. The pixels of an unordered cloud are one row.
  kPoints32,
};

/// Bytes of one pixel.
int BytesPerPixel(PixelFormat format);
/// "gray8", "rgb8", ...
std::string_view Name(PixelFormat format);

struct Image {
  int width = 0;
  int height = 0;
  PixelFormat format = PixelFormat::kGray8;
  /// Row by row from the top, no padding.
  std::vector<uint8_t> bytes;

  /// Index of a pixel's first byte.
  size_t Offset(int column, int row) const {
    return (static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)) *
           static_cast<size_t>(BytesPerPixel(format));
  }
};

/// No sensor of ours measures further, m; broken drivers write the largest float.
inline constexpr float kDepthMaxM = 1000.0f;

/// Metres along the optical axis; 0 = no reading, or one beyond kDepthMaxM. Requires: kDepth16 or
/// kDepth32, inside.
float DepthAt(const Image& image, int column, int row);
/// Metres, in the sensor's frame; NaN = no reading. Requires: kPoints32, inside.
Eigen::Vector3f PointAt(const Image& image, int column, int row);
/// class << 8 | instance. Requires: kLabel16, inside.
uint16_t LabelAt(const Image& image, int column, int row);

}  // namespace dsg::ingest
