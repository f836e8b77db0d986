// SPDX-License-Identifier: Apache-2.0
// A network of one convolution that finds upright rectangles of 8 x 16 pixels: red ones are class
// 0, green ones class 1. Refuses other sizes and colours.
#pragma once

#include <string>

#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Edges of the input, pixels; boxes stand 4 pixels apart.
inline constexpr int kTinyInputPx = 64;
inline constexpr int kTinyBoxCount = 256;

struct TinyDetector {
  enum class Output {
    /// [1, 256, 7].
    kRows,
    /// [1, 6, 256].
    kColumns,
    /// [1, 1, 256, 7].
    kSsd,
    /// [1, 16, 16], which says nothing.
    kSquare,
    /// [1, 1, 16, 16].
    kMap,
  };
  Output output = Output::kRows;
  /// Scores end with a sigmoid.
  bool has_sigmoid = true;
  /// A second output beside the first, of the map the convolution makes.
  bool has_raw_output = false;
  int channel_count = 3;
};

/// An ONNX file.
std::string MakeTinyDetector(const TinyDetector& options);

/// Black.
Image BlankImage(int width, int height, PixelFormat format = PixelFormat::kRgb8);
/// In units of `size` pixels: 8 x 16 of them, from (left, top). Of a grey image, red counts.
void PaintRectangle(Image* image, int left, int top, int size, uint8_t red, uint8_t green,
                    uint8_t blue);

}  // namespace dsg::ingest
