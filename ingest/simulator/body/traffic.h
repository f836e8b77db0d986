// SPDX-License-Identifier: Apache-2.0
// Where the people planned so far will be, so that the next one can go another way or wait.
// Refuses to push anybody: it only counts how often two would touch.
#pragma once

#include <functional>
#include <vector>

#include "ingest/simulator/body/life.h"

namespace dsg::simulator {

/// Positions of all people planned so far, a few times a second.
class Traffic {
 public:
  static constexpr double kSampleS = 0.2;
  /// Between two torsos; closer than this, people touch.
  static constexpr double kTouchM = 0.5;

  explicit Traffic(double duration_s) : duration_s_(duration_s) {}

  void Add(const Life& life);
  /// Somebody else who walks about: the robot.
  void Add(const std::function<Point(TimeNs)>& position_at);
  /// Samples at which somebody is within reach of one who stands at `position` in [from, to).
  int TouchesStanding(const Point& position, TimeNs from_ns, TimeNs to_ns) const;
  int TouchesWalking(const Walk& walk, TimeNs depart_ns) const;

 private:
  int TouchesAt(const Point& position, TimeNs time_ns) const;

  double duration_s_;
  std::vector<std::vector<Point>> tracks_;
};

}  // namespace dsg::simulator
