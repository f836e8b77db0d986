// SPDX-License-Identifier: Apache-2.0
// A walkable line on the floor, and how far along it one is at a time.
// Refuses to know where lines come from.
#pragma once

#include <vector>

#include "ingest/simulator/world/free_space.h"

namespace dsg::simulator {

/// A polyline with rounded corners, parametrised by walked distance.
class Path {
 public:
  Path() = default;
  /// Corners are cut by at most kCornerM along each leg and lie within a quarter of that of
  /// `waypoints`. Requires: at least one waypoint.
  explicit Path(const std::vector<Point>& waypoints);

  static constexpr double kCornerM = 0.4;

  double length_m() const { return distances_.back(); }
  const std::vector<Point>& points() const { return points_; }
  /// Walked distance at points()[i].
  double DistanceAt(size_t index) const { return distances_[index]; }
  /// Clamped to the ends.
  Point At(double distance_m) const;
  /// Direction of walking, averaged over half a metre so that it turns smoothly, radians.
  double HeadingAt(double distance_m) const;

 private:
  std::vector<Point> points_ = {Point::Zero()};
  std::vector<double> distances_ = {0.0};
};

/// From standstill to standstill: constant acceleration, cruise, the same deceleration.
class SpeedProfile {
 public:
  SpeedProfile() = default;
  /// Requires: length >= 0, the others > 0.
  SpeedProfile(double length_m, double cruise_m_s, double acceleration_m_s2);

  double duration_s() const { return duration_s_; }
  /// Clamped to the ends.
  double DistanceAt(double time_s) const;
  /// The inverse.
  double TimeAt(double distance_m) const;

 private:
  double length_m_ = 0.0;
  double acceleration_ = 1.0;
  double speed_ = 0.0;
  double ramp_s_ = 0.0;
  double ramp_m_ = 0.0;
  double duration_s_ = 0.0;
};

}  // namespace dsg::simulator
