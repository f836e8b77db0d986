// SPDX-License-Identifier: Apache-2.0
// The robot's tour as a smooth curve with exact derivatives: what cameras and inertial units ride.
// Refuses to be sampled outside of its duration.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "ingest/simulator/world/planner.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

/// The body's motion at one instant. Body: x forward, y left, z up, origin at the IMU.
struct MotionState {
  Pose3d map_T_body;
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_body = Eigen::Vector3d::Zero();
};

struct RobotMotionOptions {
  /// Above 0, up to 86,400.
  double duration_s = 25.0;
  /// Of the body above the floor.
  double height_m = 1.2;
  /// Above 0, up to 1.5.
  double speed_m_s_max = 1.0;
  /// Standstill at the start; 0 = the log begins in mid-walk.
  double still_s = 1.5;
  /// Room to see first; -1 = any.
  int first_room = -1;
  /// Bob of a hand-held rig, 2 cm at 1.8 Hz.
  bool hand_held = false;
};

/// Position and rotation are C4: B-splines of degree five of x, y, yaw and elevation, no roll; a
/// bob is a sinusoid on top. Derivatives are exact. Rates of turning stay below 1.5 rad/s and
/// accelerations below 3 m/s^2; 0.25 m and more stay free to all sides.
///
/// Threads: safe; immutable once made.
class RobotMotion {
 public:
  /// Visits all rooms in turn with a look-around (360 degrees and more, up and down by 15) in
  /// each, comes back to the first one and does the same in reverse. Hurries where it
  /// would miss a room otherwise. `world` must outlive the call only.
  ///
  /// Requires: a world from GenerateWorld, options in bounds.
  /// Cost: about 0.1 s for five minutes in a building of 50 rooms, 0.4 s where it tries to rush.
  static std::unique_ptr<RobotMotion> Make(const World& world, const RobotMotionOptions& options,
                                           uint64_t seed);
  virtual ~RobotMotion() = default;
  virtual TimeNs duration_ns() const = 0;
  /// Requires: 0 <= time_ns <= duration_ns().
  virtual MotionState StateAt(TimeNs time_ns) const = 0;
  /// How many of the rooms it enters within the duration.
  virtual int rooms_visited() const = 0;
};

}  // namespace dsg::simulator
