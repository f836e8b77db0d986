// SPDX-License-Identifier: Apache-2.0
// A network of one convolution that tells colours apart: class 0 is dark, 1 red, 2 green, 3 blue.
// Refuses to know shapes.
#pragma once

#include <string>

namespace dsg::ingest {

struct TinySegmenter {
  enum class Output {
    /// [1, 4, height / stride, width / stride].
    kScores,
    /// [1, 1, height / stride, width / stride]: numbers of classes.
    kNumbers,
    /// [1, height / stride, width / stride].
    kFlatNumbers,
    /// [1, 4, cells], which is no map.
    kTable,
  };
  Output output = Output::kScores;
  int width_px = 32;
  int height_px = 32;
  int stride_px = 1;
  /// Adds the scores as a second output, under another name.
  bool has_second_output = false;
  /// Of an input that is red, green and blue; dark is below it.
  float dark_below = 0.3f;
};

/// An ONNX file.
std::string MakeTinySegmenter(const TinySegmenter& options);

}  // namespace dsg::ingest
