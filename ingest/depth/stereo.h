// SPDX-License-Identifier: Apache-2.0
// Depth from two grey images of a calibrated pair.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/depth/depth_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// A rectified pair with semi-global matching (Hirschmueller 2008, OpenCV's), checked from left
/// to right, speckles and untextured pixels removed.
///
/// Looked for between StereoOptions::nearest_m and the range. The same result with any number of
/// threads.
///
/// Threads: Compute may be called from several.
class StereoDepth {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID when the cameras' sizes differ, they look apart by
  /// more than 30 degrees, are nearer than 1 mm to each other, or stand above or behind each
  /// other rather than side by side. Either may be the one on the left. `range_m` 0 = 5 m.
  static absl::StatusOr<StereoDepth> Make(const CameraCalibration& left,
                                          const CameraCalibration& right, double range_m,
                                          const StereoOptions& options = {});
  ~StereoDepth();
  StereoDepth(StereoDepth&&) noexcept;
  StereoDepth& operator=(StereoDepth&&) noexcept;

  /// The left camera after rectification: without distortion, its body_T_camera turned.
  const CameraCalibration& camera() const;

  /// Metres along the rectified optical axis; 0 = no reading.
  /// Errors: INVALID_ARGUMENT when a size differs from the calibration, or it is not grey.
  absl::StatusOr<std::vector<float>> Compute(const Image& left, const Image& right) const;

 private:
  class Impl;
  explicit StereoDepth(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
