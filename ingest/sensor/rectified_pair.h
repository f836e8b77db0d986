// SPDX-License-Identifier: Apache-2.0
// Two cameras turned side by side, so that a point is in the same row of both images.
// Refuses pairs that see too little in common, or of which one looks past the other.
#pragma once

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// Both have the same size and intrinsics, no distortion, the same orientation, and differ in
/// position along their x axis only. Each keeps its place.
/// Source: Fusiello, Trucco and Verri, "A compact algorithm for rectification of stereo pairs",
/// Machine Vision and Applications 12, 2000.
struct RectifiedPair {
  CameraCalibration left;
  CameraCalibration right;
  /// Metres; negative when the right camera stands on the left.
  double baseline_m = 0.0;

  /// Either camera may be the one on the left.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for cameras that are not valid, whose sizes differ,
  /// that look apart by more than 30 degrees, are nearer than 1 mm to each other, or stand above or
  /// behind each other rather than side by side.
  static absl::StatusOr<RectifiedPair> Make(const CameraCalibration& left,
                                            const CameraCalibration& right);
};

}  // namespace dsg::ingest
