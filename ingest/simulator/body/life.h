// SPDX-License-Identifier: Apache-2.0
// One person's plan for a whole log: stands, turns, walks, reaches, and what the hands carry.
// Refuses to decide anything; it only answers what the plan says at an instant.
#pragma once

#include <vector>

#include "ingest/simulator/body/gait.h"
#include "ingest/simulator/body/reach.h"
#include "ingest/simulator/world/path.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

/// A walk whose heading is smoothed over time, so that nobody spins on a corner.
class Walk {
 public:
  static constexpr double kAccelerationMps2 = 0.7;

  Walk() = default;
  /// Requires: the path is longer than 0; the speed is above 0.
  Walk(const Path& path, double cruise_m_s);

  const Path& path() const { return path_; }
  TimeNs duration_ns() const { return duration_ns_; }
  /// Since departure.
  double DistanceAt(double time_s) const { return profile_.DistanceAt(time_s); }
  Point PositionAt(double time_s) const { return path_.At(DistanceAt(time_s)); }
  /// Radians, not wrapped.
  double YawAt(double time_s) const;

 private:
  Path path_;
  SpeedProfile profile_;
  TimeNs duration_ns_ = 0;
  /// At equal time steps.
  std::vector<double> yaws_;
};

/// Standing, perhaps turning on the spot, or walking.
struct LifeSegment {
  TimeNs begin_ns = 0;
  TimeNs end_ns = 0;
  bool walks = false;
  /// Of a stand.
  Point position = Point::Zero();
  double yaw_begin = 0.0;
  double yaw_end = 0.0;
  Walk walk;
};

/// The hand is at `target_map` at contact, goes there before and comes back after.
struct LifeReach {
  TimeNs contact_ns = 0;
  ReachPlan plan;
  Eigen::Vector3d target_map = Eigen::Vector3d::Zero();

  static constexpr double kInS = 1.1;
  static constexpr double kHoldS = 0.2;
  static constexpr double kOutS = 1.1;
  /// 0 to 1.
  double ShareAt(TimeNs time_ns) const;
};

/// Something is in a hand from the middle of one hold to the middle of the next.
struct LifeCarry {
  TimeNs begin_ns = 0;
  TimeNs end_ns = kTimeMax;
  Side side = Side::kRight;
};

/// Standing on the floor's plane.
struct FloorState {
  Point position = Point::Zero();
  double yaw = 0.0;
  GaitState gait;
};

struct Life {
  /// Without gaps, the last one ends after the log.
  std::vector<LifeSegment> segments;
  /// Ascending, not overlapping.
  std::vector<LifeReach> reaches;
  std::vector<LifeCarry> carries;
  /// Makes people sway out of step.
  double idle_offset_s = 0.0;

  FloorState FloorAt(const BodyModel& body, TimeNs time_ns) const;
  Point PositionAt(TimeNs time_ns) const;
  /// The pelvis's frame: above the floor position, z up.
  Pose3d TorsoAt(const BodyModel& body, TimeNs time_ns) const;
  Posture PostureAt(const BodyModel& body, TimeNs time_ns) const;
};

/// The pelvis's frame of a body that stands there.
Pose3d StandingTorso(const BodyModel& body, const Point& position, double yaw);

/// How long a turn on the spot takes.
double TurnDurationS(double from_rad, double to_rad);

inline TimeNs NsOf(double seconds) {
  return static_cast<TimeNs>(seconds * static_cast<double>(kNsPerSecond));
}
inline double SecondsOf(TimeNs ns) {
  return static_cast<double>(ns) / static_cast<double>(kNsPerSecond);
}

}  // namespace dsg::simulator
