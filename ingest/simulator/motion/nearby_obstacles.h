// SPDX-License-Identifier: Apache-2.0
// The obstacles around a point of the floor, found by cells: for work at thousands of points.
// Refuses to see farther than its reach.
#pragma once

#include <vector>

#include "ingest/simulator/world/free_space.h"

namespace dsg::simulator {

/// Threads: safe; immutable.
class NearbyObstacles {
 public:
  /// Requires: reach > 0.
  NearbyObstacles(const FreeSpace& free_space, double reach_m);

  /// The reach if nothing is nearer.
  double Clearance(const Point& point) const;
  /// The sum over all obstacles nearer than `distance` of what each lacks, pointing away from it.
  /// Requires: distance <= reach.
  Point Push(const Point& point, double distance_m) const;

 private:
  static constexpr double kCellM = 0.5;

  const std::vector<Rect>& Around(const Point& point) const;

  double reach_m_;
  Rect bounds_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<Rect>> cells_;
  std::vector<Rect> none_;
};

}  // namespace dsg::simulator
