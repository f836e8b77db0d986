// SPDX-License-Identifier: Apache-2.0
// What is wrong with inertial samples that are in order: units of measure, axes, clipped peaks,
// values that stand still. It is guessed from samples alone, or from turns that cameras saw.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/sensor/imu_measurement.h"

namespace dsg::ingest {

enum class ImuFaultKind {
  /// Accelerations are in g, mg, cm/s^2 or ft/s^2.
  kForceUnit,
  /// Gravity was subtracted from them.
  kNoGravity,
  /// They are too large or too small by a factor that is no unit's.
  kForceScale,
  /// Rates are in degrees, mrad or mdeg / second, or were made radians twice.
  kRateUnit,
  kRateScale,
  /// Axes of the gyro are swapped, or point the other way.
  kAxes,
  /// The gyro turns otherwise than the cameras, however its axes are called.
  kUnrelated,
  /// Peaks are cut off at the end of the range.
  kClipped,
  /// All values stand still for longer than a gap may be.
  kStuck,
  /// Too many samples repeat the one before.
  kRepeated,
};

struct ImuFault {
  ImuFaultKind kind = ImuFaultKind::kForceUnit;
  /// A sentence with the unit's name, the values, and what to do.
  std::string text;
};

/// How far the unit turned between two instants, as cameras saw it.
struct SeenTurn {
  /// From the first instant to the second, as of CutSamples or Preintegration::samples.
  std::span<const ImuMeasurement> samples;
  Eigen::Quaterniond from_R_to = Eigen::Quaterniond::Identity();
};

/// What accelerations look like whose length is `force` where it should be that of gravity: "these
/// look like g, multiply them by 9.80665".
std::string GuessAtForce(double force, const InertialOptions& options);

/// What samples of any motion tell by themselves. Units of measure are told of accelerations only,
/// and of stretches of options.fault.span_ns or longer. Empty: nothing is found.
/// Requires: CheckSamples accepts them. Cost: n log n.
std::vector<ImuFault> FaultsOfSamples(std::span<const ImuMeasurement> samples,
                                      const std::string& unit, const InertialOptions& options);

/// What the gyro's rates are, compared with those that cameras saw: of the 48 ways to call its axes
/// x, y, z and their opposites the one that fits best, with any scale and any bias; a "?" stands
/// for an axis that turned too little. Empty: nothing is found, or the turns are too few or too
/// much alike to tell.
///
/// Axes of the accelerometer and its sign are not compared. Between keyframes a turn is taken as
/// one about a fixed axis: of a radian or less. Requires: CheckSamples accepts the samples of each.
std::vector<ImuFault> FaultsOfTurns(std::span<const SeenTurn> turns, const std::string& unit,
                                    const InertialOptions& options);

}  // namespace dsg::ingest
