// SPDX-License-Identifier: Apache-2.0
// Finds people in images with a network that the user names.
// Refuses to bring a network of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// How a network's output is read.
struct PersonDetectorOptions {
  /// ONNX.
  std::string model_file;
  int input_width_px = 640;
  int input_height_px = 640;
  double score_min = 0.5;
  /// Boxes that share more than this (intersection over union) are one.
  double overlap_max = 0.5;
  /// Of "person" among the network's classes.
  int person_class = 0;
};

/// Threads: one caller at a time.
class PersonDetector {
 public:
  /// Errors: NOT_FOUND for a missing file; INVALID_ARGUMENT/FILE_MALFORMED when OpenCV cannot read
  /// the model or its output has a shape that is not known (docs/sensor_logs.md lists them).
  static absl::StatusOr<std::unique_ptr<PersonDetector>> Load(const PersonDetectorOptions& options);
  virtual ~PersonDetector() = default;

  /// Boxes without joints, ids from `first_id` on, best score first.
  /// Errors: INVALID_ARGUMENT for an image that is no colour or grey one; INTERNAL with OpenCV's
  /// words when the network fails.
  virtual absl::StatusOr<std::vector<HumanDetection>> Detect(const Image& image, TimeNs time_ns,
                                                             const std::string& camera,
                                                             int64_t first_id) = 0;
};

}  // namespace dsg::ingest
