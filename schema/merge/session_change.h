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
  /// Boxes shrink by this on each side before they are compared with free space: maps are noisy.
  double slack_m = 0.1;
  /// Of sample points of a box: at least this share must lie in free space.
  double free_share_min = 0.5;
  /// What a thing stood on, seen where it stood: at least this share of its underside.
  double ground_share_min = 0.6;
  /// A thing that left its spot is looked for as far away as this, if either map has only one of
  /// its class.
  double move_max_m = 30.0;
  /// Nearer than this it is known again among others of its class...
  double nudge_max_m = 4.0;
  /// ... if those are this many times as far away.
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

/// A thing of `into` that is gone, and when that was seen first.
struct Gone {
  int into = 0;
  TimeNs at_ns = 0;
};

/// What a mesh shows of a box.
struct BoxSurface {
  /// Vertices well inside.
  int inside_count = 0;
  /// Of the underside (in cells of a decimetre) the share on which there is surface.
  double ground_share = 0.0;
  /// When that was first seen; kTimeMin without a time.
  TimeNs ground_first_ns = kTimeMin;
};

/// Looks at a box in the mesh of the other map; `slack_m` is taken off its sides for what is
/// inside. May be empty.
using SurfaceProbe = std::function<absl::StatusOr<BoxSurface>(const Pose3d& map_T_box,
                                                              const Box3d& box, double slack_m)>;

/// Looks into the mesh of `other`, which `map_T_other` carries into the frame of the boxes. A box
/// of more than some hundred blocks counts as full of matter.
///
/// Threads: one caller at a time. `other` must outlive the probe.
SurfaceProbe ProbeMesh(const Snapshot& other, const Pose3d& map_T_other);

struct SessionChanges {
  /// Ascending by `into`.
  std::vector<Gone> gone;
  /// Index in `into` of one that is gone, index in `other` of the same thing at its new spot.
  std::vector<std::pair<int, int>> moved;
};

/// Free space as the places of a map know it.
/// `default_ns`: for places without a time of their own.
std::vector<FreeSpot> FreeSpaceOf(const MapContent& content, TimeNs default_ns);

/// `other` is in the frame of `into`, and `pair_of` says which of its nodes are in `into` already.
/// Only objects that were last seen before the session looked can be gone; what is carried by such
/// a one (ON, IN) goes with it. A thing has moved when it is gone here, one of its class, size and
/// colour is new where `into` knew free space, and neither has a rival nearly as near.
/// Errors: what `stop` and `probe` returned.
absl::StatusOr<SessionChanges> FindChanges(const MapContent& into, const MapContent& other,
                                           const std::vector<int>& pair_of,
                                           const ChangeOptions& options, const SurfaceProbe& probe,
                                           const StopCheck& stop);

}  // namespace dsg::merge
