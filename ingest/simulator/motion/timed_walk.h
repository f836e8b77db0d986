// SPDX-License-Identifier: Apache-2.0
// A walk along a line on the floor: where one is and which way one looks at a time.
// Refuses to turn or to speed up faster than its limits.
#pragma once

#include <vector>

#include "ingest/simulator/world/free_space.h"

namespace dsg::simulator {

struct WalkLimits {
  double speed_m_s = 0.8;
  /// Along the line and across it.
  double acceleration_m_s2 = 0.6;
  double turn_rad_s = 0.9;
};

/// From standstill to standstill.
class TimedWalk {
 public:
  /// Requires: at least one point, limits > 0.
  TimedWalk(const std::vector<Point>& line, const WalkLimits& limits);

  double duration_s() const { return times_.back(); }
  double length_m() const { return step_m_ * static_cast<double>(points_.size() - 1); }
  /// Clamped to the ends.
  Point PositionAt(double time_s) const;
  /// Ahead along the line, continuous, not wrapped to a turn; clamped to the ends.
  double HeadingAt(double time_s) const;

 private:
  void SetHeadings();
  std::vector<double> SpeedLimits(const WalkLimits& limits) const;
  void SetTimes(const WalkLimits& limits);
  /// Steps from the beginning, with a fraction.
  double StepsAt(double time_s) const;

  double step_m_ = 0.0;
  std::vector<Point> points_;
  std::vector<double> headings_;
  std::vector<double> speeds_;
  std::vector<double> times_;
};

}  // namespace dsg::simulator
