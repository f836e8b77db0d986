// SPDX-License-Identifier: Apache-2.0
// What an inertial unit on the moving robot measures, with noise and biases of its data sheet.
// Refuses to know lever arms: the unit is the origin of the body.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/simulator/motion/robot_motion.h"
#include "schema/base/random.h"

namespace dsg::simulator {

inline constexpr double kGravityM_S2 = 9.81;

/// Densities are those of ImuCalibration; the defaults are the ADIS16448's as EuRoC tells them.
struct ImuModel {
  double gyro_noise_density = 1.6968e-4;
  double gyro_random_walk = 1.9393e-5;
  double accel_noise_density = 2.0e-3;
  double accel_random_walk = 3.0e-3;
  /// Multiplies the four above: a unit worse than its data sheet. 0 = none.
  double noise_factor = 1.0;
  /// Standard deviations on each axis of the biases at the beginning, rad/s and m/s^2.
  double gyro_turn_on_bias = 2.0e-3;
  double accel_turn_on_bias = 0.05;
  /// Standard deviation of each element by which scale and axes differ from the identity.
  double misalignment = 0.0;
  /// Readings are cut at +- these, rad/s and m/s^2.
  double gyro_max = 17.5;
  double accel_max = 177.0;

  /// Neither noise nor biases.
  static ImuModel Perfect();
};

struct ImuSample {
  TimeNs time_ns = 0;
  /// As measured, rad/s and m/s^2, body frame.
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
  /// The truth behind them.
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

/// Samples at 0, 1 / rate, ... to the end of the motion. Same seed, same samples.
/// Requires: rate_hz > 0.
/// Source: Forster, Carlone, Dellaert, Scaramuzza, T-RO 2017, equations 27 and 28.
std::vector<ImuSample> SimulateImu(const RobotMotion& motion, const ImuModel& model, double rate_hz,
                                   uint64_t seed);

/// Three normal numbers of standard deviation `sigma`.
Eigen::Vector3d NormalVector(double sigma, Random* random);

}  // namespace dsg::simulator
