// SPDX-License-Identifier: Apache-2.0
// The numbers of inertial odometry.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

struct InertialOptions {
  /// Samples further apart than this do not tell the motion in between, ns.
  TimeNs gap_ns_max = 50'000'000;
  /// Biases further than this from those of an integration, rad/s and m/s^2, want a new one.
  double gyro_bias_shift_max = 0.01;
  double accel_bias_shift_max = 0.1;
  /// Of the place, m/s^2.
  double gravity_m_s2 = 9.81;
  /// Standing still is told of samples of this long, ns.
  TimeNs rest_ns = kNsPerSecond;
  /// Standard deviations of an axis at rest, rad/s and m/s^2; motors may run.
  double rest_gyro_sigma_max = 0.02;
  double rest_accel_sigma_max = 0.25;
  /// Largest bias of a gyro, rad/s.
  double rest_rate_max = 0.2;
  /// By how much what is felt at rest may differ from gravity, m/s^2.
  double rest_gravity_error_max = 0.5;
  /// Standard deviation of the accelerometer's bias after it was switched on, m/s^2.
  double rest_accel_bias_sigma = 0.1;

  Eigen::Vector3d gravity_map() const { return {0.0, 0.0, -gravity_m_s2}; }
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
