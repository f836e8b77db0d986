// SPDX-License-Identifier: Apache-2.0
// The numbers of inertial odometry.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Of AlignInMotion.
struct MotionStartOptions {
  /// Keyframes at least.
  int keyframe_count_min = 5;
  /// What the cameras' pose of a keyframe relative to the one before errs by, one standard
  /// deviation of each axis, m and rad.
  double way_sigma_m = 0.004;
  double turn_sigma_rad = 0.0025;
  /// Most by which cameras and unit differ between two keyframes, standard deviations.
  double misfit_sigma_max = 5.0;
  /// By how much gravity may differ in length when it is left free, m/s^2.
  double gravity_error_max = 0.3;
  /// What may be unknown of where up is, one standard deviation, rad.
  double tilt_sigma_max = 0.02;
  /// Steps of the fit of all states together.
  int step_count = 4;

  std::vector<BoundOption> Bind();
};

/// Of FaultsOfSamples and FaultsOfTurns.
struct ImuFaultOptions {
  /// Samples of this long at least say what their unit of measure is, ns.
  TimeNs span_ns = kNsPerSecond;
  /// Share by which a scale may differ from that of a unit of measure.
  double scale_error_max = 0.15;
  /// Nine of ten accelerations are within this share of gravity.
  double force_spread_max = 0.5;
  /// Samples at one value in a row that make a peak a clipped one, and where such peaks are looked
  /// for, rad/s and m/s^2.
  int clipped_count_min = 5;
  double clipped_rate_min = 2.0;
  double clipped_accel_min = 15.0;
  /// Share of the samples that may repeat the one before.
  double repeat_share_max = 0.3;
  /// Turns between keyframes that are compared, so many at least, and how much their rate varies
  /// by, one standard deviation, rad/s.
  int turn_count_min = 5;
  double turn_rate_sigma_min = 0.1;
  /// Correlation of the rates that unit and cameras see.
  double turn_correlation_min = 0.8;
  /// Another arrangement of the axes is told if it leaves so many times less than the
  /// calibration's.
  double axes_ratio_min = 2.0;

  std::vector<BoundOption> Bind();
};

struct InertialOptions {
  /// Samples further apart than this do not tell the motion in between, ns.
  TimeNs gap_ns_max = 50'000'000;
  /// No unit on a robot measures more, rad/s and m/s^2, once odometry has started: until then it
  /// may be another unit of measure.
  double rate_max_rad_s = 100.0;
  double force_max_m_s2 = 1000.0;
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
  MotionStartOptions start;
  ImuFaultOptions fault;

  Eigen::Vector3d gravity_map() const { return {0.0, 0.0, -gravity_m_s2}; }
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
