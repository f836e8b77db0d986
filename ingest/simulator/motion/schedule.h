// SPDX-License-Identifier: Apache-2.0
// When the robot is where on its tour, and where it looks, before smoothing.
// Refuses to be smooth: speeds have corners, which the spline through it rounds.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/simulator/motion/robot_motion.h"
#include "ingest/simulator/motion/timed_walk.h"
#include "ingest/simulator/world/path.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// How hastily a tour is made.
struct Pace {
  /// Of the fastest walk allowed, drawn anew for each walk.
  double speed_ratio_min = 0.7;
  double speed_ratio_max = 1.0;
  double acceleration_m_s2 = 0.6;
  /// While walking.
  double turn_rad_s = 0.8;
  /// While looking around.
  double look_rad_s = 1.15;
  /// Looking around begins before the robot stands and ends after it walks again.
  double look_before_s = 0.5;
  double look_after_s = 1.5;
  double center_pull = 2.0;
};

/// x, y, yaw (not wrapped) and elevation of the look, against the map.
class Schedule {
 public:
  using Reference = Eigen::Vector4d;

  /// Long enough for `duration_s`. Each `attempt` of a seed is another tour. Requires: a world with
  /// places; speed > 0.
  Schedule(const World& world, const Pace& pace, const RobotMotionOptions& options,
           double duration_s, uint64_t seed, int attempt);

  /// Stands at the beginning before time 0. Requires: time_s <= duration_s.
  Reference At(double time_s) const;

 private:
  struct Leg {
    double begin_s = 0.0;
    /// Added to the walk's headings so that the yaw never jumps by a turn.
    double yaw_offset = 0.0;
    TimedWalk walk;
    /// The look-around at the end of the walk, from one yaw to another.
    double look_begin_s = 0.0;
    double look_from = 0.0;
    double look_angle = 0.0;
    SpeedProfile look;

    double LookEnd() const { return look_begin_s + look.duration_s(); }
    double YawAt(double time_s) const { return yaw_offset + walk.HeadingAt(time_s - begin_s); }
  };

  /// Plans the look-around at the end of `leg`, and when `next` begins.
  static void Join(const Pace& pace, Leg* leg, Leg* next);

  std::vector<Leg> legs_;
};

}  // namespace dsg::simulator
