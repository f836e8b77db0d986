// SPDX-License-Identifier: Apache-2.0
// Where inertial samples alone would put the robot, and how wrong that may be: the simulator's
// check of itself. Refuses to estimate anything; it starts from the truth.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "ingest/simulator/motion/imu.h"

namespace dsg::simulator {

struct NavigationState {
  Pose3d map_T_body;
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
};

/// The states at all samples, the start first; biases taken as constant. Forces by the trapezoid
/// rule; rates of turning by cubics through four samples and with coning, since a tilt of a few
/// microradians turns gravity into centimetres within a minute.
/// Requires: at least one sample, equally spaced.
std::vector<NavigationState> IntegrateImu(std::span<const ImuSample> samples,
                                          const NavigationState& start,
                                          const Eigen::Vector3d& gyro_bias,
                                          const Eigen::Vector3d& accel_bias);

/// Order: rotation (body frame, on the right), velocity and position (map frame).
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Covariance of the last state of IntegrateImu, from an exact start with exact biases at the
/// start: white noise, and biases that walk on. Requires: at least two samples; densities > 0.
/// Source: Forster, Carlone, Dellaert, Scaramuzza, T-RO 2017, appendix A, with biases appended.
Matrix9d PredictCovariance(std::span<const ImuSample> samples, const NavigationState& start,
                           const ImuModel& model);

/// One window of time, integrated from its true beginning.
struct ReckonedWindow {
  TimeNs begin_ns = 0;
  Vector9d error = Vector9d::Zero();
  Matrix9d covariance = Matrix9d::Zero();

  double PositionErrorM() const { return error.tail<3>().norm(); }
  double RotationErrorRad() const { return error.head<3>().norm(); }
};

/// Windows one after the other; a rest at the end is left out. `model` is what one believes of the
/// samples, not what made them. Requires: window_ns > 0.
std::vector<ReckonedWindow> ReckonWindows(const RobotMotion& motion,
                                          std::span<const ImuSample> samples, const ImuModel& model,
                                          TimeNs window_ns);

/// Shares of the windows whose error lies in the ellipsoid that should hold 95 % of them; 0 to 1,
/// all 0 without windows.
struct ReckoningShares {
  int window_count = 0;
  double position = 0.0;
  double rotation = 0.0;
  /// Of all nine together.
  double all = 0.0;
};
ReckoningShares SharesWithin(const std::vector<ReckonedWindow>& windows);

}  // namespace dsg::simulator
