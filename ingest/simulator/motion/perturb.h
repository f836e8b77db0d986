// SPDX-License-Identifier: Apache-2.0
// The simulated rig, and a calibration of it that is a little wrong, as all real ones are.
// Refuses to change what a calibration cannot get wrong: names, sizes, rates, models.
#pragma once

#include <cstdint>

#include "ingest/sensor/calibration.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// The rig of the uHumans2 logs: cam0 and cam1 (grey, 20 Hz, 0.1 m apart), color0, depth0 and
/// label0 (5 Hz, in cam0's place), imu0 (200 Hz, ADIS16448) in the body's origin.
/// Source: RSS 2020, section VI-A; Kimera-VIO, parameters of uHumans1.
ingest::RigCalibration ReferenceRig();

/// Standard deviations; draws are cut at three of them. 0 = exact.
struct PerturbOptions {
  /// Of each focal length and of each coordinate of the principal point, pixels.
  double pixel = 0.3;
  /// Of the angle of a camera's rotation, and of the length of its shift.
  double rotation_rad = 0.1 * 0.017453292519943295;
  double translation_m = 0.002;
  double time_offset_s = 0.001;
};

struct PerturbedRig {
  /// What the log tells.
  ingest::RigCalibration told;
  /// What a picture's stamp tells minus when it was taken; all cameras share it.
  TimeNs camera_time_offset_ns = 0;
};

/// Cameras with the same pose and lens in `truth` (cam0, depth0) stay the same as each other.
PerturbedRig PerturbRig(const ingest::RigCalibration& truth, const PerturbOptions& options,
                        uint64_t seed);

}  // namespace dsg::simulator
