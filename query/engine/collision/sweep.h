// SPDX-License-Identifier: Apache-2.0
// Distances between a body, at a pose or on a straight piece of its way, and the obstacles near.
// Callers give the obstacles, all within the reach.
#pragma once

#include <functional>
#include <limits>

#include "query/engine/collision/obstacles.h"
#include "query/engine/collision/shapes.h"

namespace dsg::query {

/// The nearest obstacle, or the first one that was touched.
struct Contact {
  /// Between the surfaces; 0 if they touch. Infinite if there is nothing.
  double distance_m = std::numeric_limits<double>::infinity();
  ObstacleKind kind = ObstacleKind::kNone;
  NodeId node;
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  /// Fraction of the piece of way.
  double fraction = 0.0;
  bool hit = false;
};

/// Nearer, or as near and of a lower id; no id comes last.
bool IsNearer(const Contact& a, const Contact& b);

/// A piece of way, from one pose to another, and what may be near it.
struct Leg {
  const Body* body = nullptr;
  Pose3d from;
  Pose3d to;
  const Obstacles* obstacles = nullptr;
  const CollisionScope* scope = nullptr;
  const ObstacleFinder* finder = nullptr;
  /// Obstacles within this of the way are all there.
  double reach_m = 0.0;
};

/// Bounds of the body anywhere on the leg.
Box3d BoundsOn(const Body& body, const Pose3d& from, const Pose3d& to);

/// No point of the body moves further than this, metres.
double TravelM(const Body& body, const Pose3d& from, const Pose3d& to);

/// The first contact if there is any, else the nearest pass if nearer than `best_m` and within
/// reach. Errors: what `stop` returned.
absl::StatusOr<Contact> CheckLeg(const Leg& leg, double best_m, const StopCheck& stop);

}  // namespace dsg::query
