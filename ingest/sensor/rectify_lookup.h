// SPDX-License-Identifier: Apache-2.0
// Where the pixels of a rectified camera are in the images of the real one.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// A place for each pixel of the rectified camera, row by row. Interpolation is up to the caller.
struct RectifyLookup {
  int width = 0;
  int height = 0;
  /// Pixels of the real camera; far outside where it does not see.
  std::vector<float> u;
  std::vector<float> v;
  /// 255 where the real camera sees, else 0.
  std::vector<uint8_t> inside;
};

/// `rectified` has no distortion and the place of `real`; sizes, intrinsics and direction may
/// differ. Cost: rectified pixels.
RectifyLookup MakeRectifyLookup(const CameraCalibration& rectified, const CameraCalibration& real);

}  // namespace dsg::ingest
