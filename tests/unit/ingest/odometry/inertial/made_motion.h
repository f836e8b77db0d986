// SPDX-License-Identifier: Apache-2.0
// Made motions of an inertial unit whose true states are known, and what stereo cameras and the
// unit see of them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/inertial/preintegration.h"
#include "schema/base/random.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {

/// Swaying and swinging about a straight line. Where it is 0 the unit stands or flies straight on.
struct MadeMotion {
  Eigen::Vector3d speed_m_s = Eigen::Vector3d::Zero();
  double sway_m = 0.0;
  double swing_rad = 0.0;
  /// Turns about the vertical all the time.
  double yaw_rad_s = 0.0;
  Eigen::Quaterniond map_R_first = Eigen::Quaterniond::Identity();

  Pose3d PoseAt(double t) const {
    const Eigen::Vector3d sway(std::sin(2.0 * t), std::cos(1.6 * t + 0.4), 0.5 * std::sin(2.7 * t));
    const Eigen::Vector3d swing(std::sin(1.3 * t + 0.3), std::cos(1.9 * t), std::sin(0.9 * t));
    const Eigen::Quaterniond turned = RotationOf({0.0, 0.0, yaw_rad_s * t}) * map_R_first;
    return {speed_m_s * t + sway_m * sway, (turned * RotationOf(swing_rad * swing)).normalized()};
  }
  Eigen::Vector3d VelocityAt(double t) const {
    return speed_m_s + sway_m * Eigen::Vector3d(2.0 * std::cos(2.0 * t),
                                                -1.6 * std::sin(1.6 * t + 0.4),
                                                1.35 * std::cos(2.7 * t));
  }
  Eigen::Vector3d AccelerationAt(double t) const {
    return -sway_m * Eigen::Vector3d(4.0 * std::sin(2.0 * t), 2.56 * std::cos(1.6 * t + 0.4),
                                     3.645 * std::sin(2.7 * t));
  }
  ImuMeasurement SampleAt(double t) const {
    const double h = 1e-4;
    const Eigen::Quaterniond imu_R_map = PoseAt(t).orientation.conjugate();
    const Eigen::Quaterniond turn =
        PoseAt(t - h).orientation.conjugate() * PoseAt(t + h).orientation;
    return {std::llround(1e9 * t), RotationVectorOf(turn.normalized()) / (2.0 * h),
            imu_R_map * (AccelerationAt(t) - InertialOptions().gravity_map())};
  }
};

/// A hand that carries a rig about, turning it by half a radian.
inline MadeMotion CarriedMotion(Random* random) {
  MadeMotion motion;
  motion.speed_m_s = NormalVector(0.3, random);
  motion.sway_m = 0.1;
  motion.swing_rad = 0.5;
  motion.map_R_first = RotationOf(NormalVector(1.0, random));
  return motion;
}

/// Of poses, one standard deviation of each axis.
struct PoseNoise {
  double position_m = 0.003;
  double rotation_rad = 0.1 * M_PI / 180.0;
  /// Errors add up from keyframe to keyframe.
  bool is_chain = false;
};

/// Keyframes 0.2 s apart, in a frame of their own, and what is true there; map frame of the motion.
struct MadeWindow {
  std::vector<Pose3d> start_T_imu;
  std::vector<Preintegration> parts;
  std::vector<InertialState> truth;
  std::vector<ImuMeasurement> samples;

  std::vector<Preintegration*> Between() {
    std::vector<Preintegration*> between;
    for (Preintegration& part : parts) between.push_back(&part);
    return between;
  }
};

/// The start frame's poses of states, with noise.
inline std::vector<Pose3d> SeenPoses(const std::vector<InertialState>& truth,
                                     const PoseNoise& noise, Random* random) {
  const Pose3d start_T_map = {NormalVector(2.0, random), RotationOf(NormalVector(1.0, random))};
  std::vector<Pose3d> seen;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Pose3d error = {NormalVector(noise.position_m, random),
                          RotationOf(NormalVector(noise.rotation_rad, random))};
    Pose3d exact = start_T_map * truth[i].map_T_imu;
    if (noise.is_chain && i > 0) {
      const Pose3d way = truth[i - 1].map_T_imu.Inverse() * truth[i].map_T_imu;
      exact = seen.back() * way;
      exact.position += exact.orientation * way.orientation.conjugate() * error.position;
      exact.orientation = exact.orientation * error.orientation;
    } else if (!noise.is_chain) {
      exact.position += error.position;
      exact.orientation = exact.orientation * error.orientation;
    }
    seen.push_back({exact.position, exact.orientation.normalized()});
  }
  return seen;
}

/// `bias` is that of the first sample; the unit's noise and walk are added to `samples`, which
/// begin at `from_s`.
inline MadeWindow MakeWindow(const MadeMotion& motion, double from_s, int keyframe_count,
                             const ImuBias& bias, const PoseNoise& noise, Random* random,
                             double step_s = 0.2) {
  const ImuCalibration unit = Adis16448();
  MadeWindow window;
  const double dt = 1.0 / unit.rate_hz;
  const int per_step = static_cast<int>(std::lround(step_s / dt));
  for (int i = 0; i <= per_step * (keyframe_count - 1); ++i) {
    window.samples.push_back(motion.SampleAt(from_s + dt * i));
    window.samples.back().angular_velocity_rad_s += bias.gyro_rad_s;
    window.samples.back().acceleration_m_s2 += bias.accel_m_s2;
  }
  ImuBias walked;
  window.samples = Noisy(std::move(window.samples), unit, random, &walked);
  for (int i = 0; i < keyframe_count; ++i) {
    const double t = from_s + step_s * i;
    const double share = i / static_cast<double>(keyframe_count - 1);
    window.truth.push_back({motion.PoseAt(t),
                            motion.VelocityAt(t),
                            {bias.gyro_rad_s + share * walked.gyro_rad_s,
                             bias.accel_m_s2 + share * walked.accel_m_s2}});
  }
  window.start_T_imu = SeenPoses(window.truth, noise, random);
  return window;
}

/// From each keyframe to the next, with biases of 0. `samples` may have been spoilt.
inline bool Integrate(MadeWindow* window, double step_s = 0.2) {
  window->parts.clear();
  const TimeNs step_ns = std::llround(1e9 * step_s);
  for (size_t i = 0; i + 1 < window->truth.size(); ++i) {
    const TimeNs from_ns = window->samples.front().time_ns + static_cast<TimeNs>(i) * step_ns;
    auto part =
        Preintegration::Make(window->samples, from_ns, from_ns + step_ns, {}, Adis16448(), {});
    if (!part.ok()) return false;
    window->parts.push_back(*std::move(part));
  }
  return true;
}

/// What the cameras saw the unit turn by, keyframe by keyframe. Requires: integrated.
inline Eigen::Quaterniond SeenTurnOf(const MadeWindow& window, size_t i) {
  return (window.start_T_imu[i].orientation.conjugate() * window.start_T_imu[i + 1].orientation)
      .normalized();
}

}  // namespace dsg::ingest
