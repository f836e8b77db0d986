// SPDX-License-Identifier: Apache-2.0
// The first states of a robot that moves already: which way is up, how fast it is, and what its
// gyro and accelerometer read too much, from poses that stereo cameras chained and the inertial
// samples in between.
// Source: Qin, Li, Shen, T-RO 2018, section V-B, with the scale known.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/alignment.h"
#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/inertial/preintegration.h"
#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

struct AlignedPath {
  /// At the last keyframe: at the origin of the map, turned upright from the map's axes by the
  /// shortest turn, and then by the yaw. Position and yaw are known, as in AlignAtRest.
  AlignedState last;
  /// At all keyframes, in the same map; the last one too.
  std::vector<InertialState> states;
  /// Length of gravity when it was left free, m/s^2.
  double free_gravity_m_s2 = 0.0;
};

/// `start_T_imu` are poses at keyframes in any one frame, in metres, as stereo chains them:
/// errors are those of each pose relative to the one before. `between` are the integrations from
/// each keyframe to the next. Their accelerometer biases are what is known of it already (0 if
/// nothing is), within options.rest_accel_bias_sigma; their gyro biases do not matter.
///
/// First the gyro's bias, from turns; then velocities and gravity, by linear least squares; then
/// all states together with gravity's length known, by Gauss-Newton, which also gives the
/// covariance. The accelerometer's bias is part of it: where the unit turns too little to tell it
/// from a tilt, both stay as uncertain as they are. Speed does not matter: a unit that stands still
/// or moves at a constant speed feels gravity as well.
///
/// Integrations whose gyro bias is far from what is found are integrated anew, also when this
/// refuses; their accelerometer's bias stays.
///
/// Errors, which name the unit, times and values: FIELD_INVALID for a calibration that Validate
/// refuses, counts or times that do not fit each other and poses that are none; FAILED_PRECONDITION
/// when keyframes are too few or too near to each other to tell up from acceleration (wait for
/// more), when cameras and unit disagree, when a gyro bias is too large to be one, and when gravity
/// has another length, with what FaultsOfTurns and GuessAtForce find.
///
/// Cost: the cube of the keyframes.
absl::StatusOr<AlignedPath> AlignInMotion(std::span<const Pose3d> start_T_imu,
                                          std::span<Preintegration* const> between,
                                          const ImuCalibration& calibration, double yaw_rad,
                                          const InertialOptions& options);

}  // namespace dsg::ingest
