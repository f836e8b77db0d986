// SPDX-License-Identifier: Apache-2.0
// Gives each pixel of an image a class, with a network that the user names.
// Refuses to bring a network of its own.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// How a network's input is made and its output read.
struct SegmenterOptions {
  /// ONNX.
  std::string model_file;
  int input_width_px = 512;
  int input_height_px = 512;
  /// The input is (pixel - mean) * scale, pixels from 0 to 255: red, green, blue.
  std::array<double, 3> mean = {0.0, 0.0, 0.0};
  std::array<double, 3> scale = {1.0 / 255.0, 1.0 / 255.0, 1.0 / 255.0};
  /// By number of the network's class: the pixel of kLabel16 that it becomes, 0 = unknown.
  std::vector<uint16_t> label_of_class;
  /// Where `label_of_class` is from, for messages.
  std::string classes_file;
};

/// Threads: any number of callers; one picture at a time is worked on.
class Segmenter {
 public:
  /// Errors: NOT_FOUND for a missing file; INVALID_ARGUMENT/FIELD_INVALID for options out of
  /// bounds; FILE_MALFORMED when OpenCV cannot read the model, its output has a shape that is not
  /// known (docs/sensor_logs.md lists them), or it has another count of classes than
  /// `label_of_class`.
  static absl::StatusOr<std::unique_ptr<Segmenter>> Load(const SegmenterOptions& options);
  virtual ~Segmenter() = default;

  /// A kLabel16 of the size of the image.
  /// Errors: INVALID_ARGUMENT for an image that is no colour or grey one; INTERNAL with OpenCV's
  /// words when the network fails, or its output changes its shape.
  virtual absl::StatusOr<Image> Segment(const Image& image) = 0;
};

}  // namespace dsg::ingest
