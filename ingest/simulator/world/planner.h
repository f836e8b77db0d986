// SPDX-License-Identifier: Apache-2.0
// Ways from one point of the floor to another that keep clear of everything.
// Refuses to leave the places graph but for shortcuts it has checked.
#pragma once

#include <vector>

#include "ingest/simulator/world/path.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// A path's points keep this far from all obstacles.
inline constexpr double kPathClearanceM = kWalkClearanceM - 0.25 * Path::kCornerM;

/// A point of the floor within a straight clear walk of a place.
struct Goal {
  int place = 0;
  Point position = Point::Zero();
};

/// Threads: safe; immutable.
class Planner {
 public:
  /// `world` must outlive the planner.
  explicit Planner(const World* world);

  /// Some point around the place, farther out where there is more room.
  Goal DrawGoal(int place, Random* random) const;

  /// A*, shortened where one sees farther, varied where there is room, rounded at the corners.
  Path Plan(const Goal& from, const Goal& to, Random* random) const;

 private:
  std::vector<int> ShortestRoute(int from, int to) const;
  std::vector<Point> Shorten(const std::vector<Point>& route) const;

  const World& world_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace dsg::simulator
