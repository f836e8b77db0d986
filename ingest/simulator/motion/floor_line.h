// SPDX-License-Identifier: Apache-2.0
// Turns a planned path into a line without corners that keeps away from obstacles.
// Refuses to change where it begins and ends, or on which side of things it passes.
#pragma once

#include <vector>

#include "ingest/simulator/motion/nearby_obstacles.h"
#include "ingest/simulator/world/path.h"

namespace dsg::simulator {

/// The line keeps this far from obstacles wherever the walk has room for it, and prefers more.
inline constexpr double kLineClearanceM = 0.29;

/// Points about 0.1 m apart; one point if the path has no length.
/// Source: Quinlan and Khatib, "Elastic bands", ICRA 1993 (tension along, repulsion from sides).
std::vector<Point> BendLine(const Path& path, const NearbyObstacles& obstacles);

/// Smallest clearance of the points, at most the reach of `obstacles`.
double LineClearance(const std::vector<Point>& line, const NearbyObstacles& obstacles);

}  // namespace dsg::simulator
