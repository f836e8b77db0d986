// SPDX-License-Identifier: Apache-2.0
// A stereo rig with an inertial unit that is swung before a cloud of points, for tests.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <vector>

#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/window/landmark_factor.h"
#include "ingest/odometry/window/sliding_window.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/random.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {

inline const Eigen::Vector3d kGravity(0.0, 0.0, -9.81);

/// A camera that looks along the unit's x axis, 5 cm before it.
inline StereoModel TestModel() {
  StereoModel model{460.0, 458.0, 360.0, 240.0, 0.11, {}};
  Eigen::Matrix3d imu_R_camera;
  imu_R_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  model.imu_T_camera = {{0.05, 0.01, -0.02}, Eigen::Quaterniond(imu_R_camera)};
  return model;
}

/// Where the unit is, in closed form: up to 0.8 m/s and 0.5 rad/s.
inline Pose3d SwungPose(double t) {
  const Eigen::Vector3d turn(0.15 * std::sin(0.9 * t), 0.2 * std::sin(0.7 * t + 0.4),
                             0.5 * std::sin(0.6 * t));
  return {{0.6 * std::sin(0.8 * t), 0.5 * std::cos(0.9 * t), 0.2 * std::sin(1.3 * t)},
          RotationOf(turn)};
}

/// Velocity of the pose, by differences.
inline Eigen::Vector3d SwungVelocity(double t) {
  constexpr double kStep = 1e-4;
  return (SwungPose(t + kStep).position - SwungPose(t - kStep).position) / (2.0 * kStep);
}

inline InertialState SwungState(double t) { return {SwungPose(t), SwungVelocity(t), {}}; }

/// What an ideal unit measures.
inline ImuMeasurement SwungMeasurement(double t) {
  constexpr double kStep = 1e-4;
  const Eigen::Quaterniond now = SwungPose(t).orientation;
  const Eigen::Vector3d rate = RotationVectorOf(SwungPose(t - kStep).orientation.conjugate() *
                                                SwungPose(t + kStep).orientation) /
                               (2.0 * kStep);
  const Eigen::Vector3d acceleration =
      (SwungVelocity(t + kStep) - SwungVelocity(t - kStep)) / (2.0 * kStep);
  return {std::llround(1e9 * t), rate, now.conjugate() * (acceleration - kGravity)};
}

/// From 0 on, at 200 Hz.
inline std::vector<ImuMeasurement> SwungMeasurements(double duration_s) {
  std::vector<ImuMeasurement> samples;
  const int count = static_cast<int>(std::lround(200.0 * duration_s));
  for (int i = 0; i <= count; ++i) samples.push_back(SwungMeasurement(i / 200.0));
  return samples;
}

/// Points of a room around the rig.
inline std::vector<Eigen::Vector3d> RoomPoints(int count, Random* random) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double angle = random->Uniform(-M_PI, M_PI);
    const double distance = random->Uniform(2.0, 7.0);
    points.emplace_back(distance * std::cos(angle), distance * std::sin(angle),
                        random->Uniform(-1.5, 1.5));
  }
  return points;
}

/// What the rig sees of the points, with noise of standard deviations in pixels; ids are the
/// indices of points. Far ones have no disparity.
inline std::vector<FeatureSight> SightsAt(const StereoModel& model, const Pose3d& map_T_imu,
                                          const std::vector<Eigen::Vector3d>& points,
                                          double pixel_px, double disparity_px, Random* random) {
  std::vector<FeatureSight> sights;
  const Pose3d camera_T_map = (map_T_imu * model.imu_T_camera).Inverse();
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at = camera_T_map * points[i];
    if (at.z() < 0.3) continue;
    const Eigen::Vector2d pixel(model.cx + model.fx * at.x() / at.z(),
                                model.cy + model.fy * at.y() / at.z());
    if (pixel.x() < 0 || pixel.x() > 720 || pixel.y() < 0 || pixel.y() > 480) continue;
    FeatureSight sight{static_cast<int64_t>(i), {pixel, {}}};
    sight.sight.pixel += pixel_px * Eigen::Vector2d(random->Normal(), random->Normal());
    if (at.z() < 6.0) {
      sight.sight.disparity_px =
          DisparityOf(model, {}, 1.0 / at.z()) + disparity_px * random->Normal();
    }
    sights.push_back(sight);
  }
  return sights;
}

/// How a test's window begins: nearly at the truth, and sure of it.
inline AlignedState BeginAt(double t) {
  AlignedState aligned;
  aligned.state = SwungState(t);
  Vector15d sigma;
  sigma << 1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 1e-3, 0.01, 0.01, 0.01, 1e-3, 1e-3, 1e-3, 0.02, 0.02, 0.02;
  aligned.covariance = sigma.cwiseAbs2().asDiagonal();
  return aligned;
}

}  // namespace dsg::ingest
