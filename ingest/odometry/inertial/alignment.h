// SPDX-License-Identifier: Apache-2.0
// The first state of a robot that stands still: which way is up, and what its gyro reads then.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/imu_measurement.h"

namespace dsg::ingest {

/// A state and how sure it is, rows as in a state.
struct AlignedState {
  /// At the last sample, at the origin of the map, at rest, turned upright from the map's axes by
  /// the shortest turn, and then by a yaw. The accelerometer's bias is 0: at rest nothing tells it
  /// from a tilt.
  InertialState state;
  /// Tilt and the accelerometer's bias belong together: a bias along the floor is a tilt.
  Matrix15d covariance = Matrix15d::Zero();
};

/// `samples` are those to look at, all of them at rest. `yaw_rad` is free, and so is the position:
/// the state starts the map.
///
/// Errors, which name the unit and the value: those of CheckSamples; FIELD_INVALID for a
/// calibration that Validate refuses; FAILED_PRECONDITION when samples are too few to tell (wait
/// for more), when the unit moves or turns, and when what it feels is no gravity, with a guess at
/// the unit of measure.
absl::StatusOr<AlignedState> AlignAtRest(std::span<const ImuMeasurement> samples,
                                         const ImuCalibration& calibration, double yaw_rad,
                                         const InertialOptions& options);

}  // namespace dsg::ingest
