// SPDX-License-Identifier: Apache-2.0
// Changes between two sessions: things that are gone because the later session saw free space
// there, and where they went. What the later session did not look at stays.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"

namespace dsg::merge {

struct ChangeOptions {
  /// Boxes shrink by this on each side before the comparison with free space, because maps are
  /// noisy.
  double slack_m = 0.1;
  /// Least share of sample points of a box that lie in free space.
  double free_share_min = 0.5;
  /// Least share of the underside of a thing where the surface that it stood on was seen.
  double ground_share_min = 0.6;
  /// Search distance for a thing that moved, if either map has only one of its class.
  double move_max_m = 30.0;
  /// Search distance among several things of its class...
  double nudge_max_m = 4.0;
  /// ... provided the others are this many times as far away.
  double nudge_ratio_min = 3.0;
};

/// The free space around a place: its box, the ball of its clearance, and for a place on the floor
/// the column of that radius up to the height of a body.
struct FreeSpot {
  Pose3d map_T_spot;
  Box3d box_spot;
  double radius_m = 0.0;
  /// When it was first seen to be free.
  TimeNs from_ns = 0;
};

/// A thing of `into` that is gone, and when its absence was first seen.
struct Gone {
  int into = 0;
  TimeNs at_ns = 0;
};

/// What the mesh of a map shows at a box.
struct BoxSurface {
  /// Vertices well inside.
  int inside_count = 0;
  /// Share of the underside (cells of a decimetre) on which there is surface.
  double ground_share = 0.0;
  /// When that surface was first seen; kTimeMin if unknown.
  TimeNs ground_first_ns = kTimeMin;
};

/// Looks at a box in the mesh of the other map. The inside begins `slack_m` within its sides. May
/// be empty.
using SurfaceProbe = std::function<absl::StatusOr<BoxSurface>(const Pose3d& map_T_box,
                                                              const Box3d& box, double slack_m)>;

/// A probe of the mesh of `other`, for boxes in the frame that `map_T_other` leads to. A box that
/// touches more than some hundred blocks counts as full.
///
/// Threads: one caller at a time. `other` must outlive the probe.
SurfaceProbe ProbeMesh(const Snapshot& other, const Pose3d& map_T_other);

struct SessionChanges {
  /// Ascending by `into`.
  std::vector<Gone> gone;
  /// Index in `into` of a thing that is gone, index in `other` of the same thing at its new place.
  std::vector<std::pair<int, int>> moved;
};

/// Free space around the places of a map. `default_ns`: time for places without one.
std::vector<FreeSpot> FreeSpaceOf(const MapContent& content, TimeNs default_ns);

/// `other` is in the frame of `into`; `pair_of` tells which of its nodes `into` has. Only objects
/// that were last seen before the session looked can be gone; what they carry (ON, IN) goes with
/// them. A thing has moved when it is gone, one of its class, size and colour is new where `into`
/// had free space, and neither has another candidate nearly as close.
/// Errors: what `stop` and `probe` returned.
absl::StatusOr<SessionChanges> FindChanges(const MapContent& into, const MapContent& other,
                                           const std::vector<int>& pair_of,
                                           const ChangeOptions& options, const SurfaceProbe& probe,
                                           const StopCheck& stop);

}  // namespace dsg::merge
