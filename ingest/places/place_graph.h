// SPDX-License-Identifier: Apache-2.0
// Places: free spots of the map and the straight ways between them, as plain data.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::ingest {

/// What a place is on. Other than floors: ways between them that the robot went (LinkStoreys).
enum class PlaceKind { kFloor, kStairs, kRamp, kLift };

struct Place {
  /// Stable over a run (see PlaceTracker); -1 = not given yet.
  int64_t id = -1;
  /// On the floor for ground robots, in the air otherwise.
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  /// Metres to the nearest obstacle; of ground robots, within the height of their body.
  double clearance_m = 0.0;
  /// Free of obstacles and seen; minus the position, axes of the map.
  Box3d free_box;
  int32_t basis_point_count = 0;
  /// Height of the floor that it belongs to; the position's z for ground robots.
  double floor_z_m = 0.0;
  PlaceKind kind = PlaceKind::kFloor;
};

/// Straight and free over its whole length.
struct PlaceLink {
  /// Indices of places; from < to.
  int from = 0;
  int to = 0;
  /// Least distance to an obstacle on the way, metres.
  double clearance_m = 0.0;
};

/// Ascending by id once they have one; links ascending by (from, to).
struct PlaceGraph {
  std::vector<Place> places;
  std::vector<PlaceLink> links;
};

}  // namespace dsg::ingest
