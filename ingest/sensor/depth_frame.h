// SPDX-License-Identifier: Apache-2.0
// One depth picture with all that is known of its pixels, and where it was taken.
// Refuses to know where the depth came from: a depth camera, or two grey ones.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// All channels have camera.width x camera.height pixels, row by row, or are empty.
struct DepthFrame {
  TimeNs time_ns = 0;
  /// Without distortion: the frame has been rectified.
  CameraCalibration camera;
  /// Camera: x right, y down, z forward.
  Pose3d map_T_camera;
  /// Metres along the optical axis, finite; 0 = no reading. Never empty.
  std::vector<float> depth_m;
  /// Red, green, blue of each pixel, 3 bytes a pixel, or empty.
  std::vector<uint8_t> rgb;
  /// class << 8 | instance, 0 = unknown, or empty. The same instance has other numbers in other
  /// frames.
  std::vector<uint16_t> labels;
  /// 1 = belongs to something that moves (a person and its rim), 0 = not; or empty.
  std::vector<uint8_t> dynamic;
  /// Depth from stereo errs with the square of the distance, a depth camera less.
  bool is_stereo = false;
};

}  // namespace dsg::ingest
