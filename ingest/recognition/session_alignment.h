// SPDX-License-Identifier: Apache-2.0
// Where the frame of one session is in that of another, from places that both have seen.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/config/option_field.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A place that both sessions saw: where the body was in either map, as it was told there, and how
/// far apart both stood.
struct SessionTie {
  TimeNs time_ns = 0;
  Pose3d map_T_body;
  Pose3d other_T_body;
  /// The other session's body in that of the first one.
  Pose3d body_T_other_body;
};

struct SessionAlignmentOptions {
  /// Ties agree if they put each other's bodies this near, and turn by as little, metres and
  /// degrees.
  double agree_m = 0.5;
  double agree_deg = 6.0;
  /// Ties that agree, at places of the other session this far apart, and their share of all.
  int agree_count_min = 3;
  int place_count_min = 2;
  double place_gap_m = 1.0;
  double agree_share_min = 0.5;
  /// Standard deviations of a tie, metres and degrees: what both paths have drifted is in it.
  double position_sigma_m = 0.15;
  double turn_sigma_deg = 1.5;

  std::vector<BoundOption> Bind();
};

/// Upright: a turn about the vertical and a shift.
struct SessionAlignment {
  Pose3d map_T_other;
  /// Of the shift of the ties' middle, metres, and of the turn, radians.
  double position_sigma_m = 0.0;
  double turn_sigma_rad = 0.0;
  int agree_count = 0;
  int tie_count = 0;
  /// Root mean square distance of the bodies that agree, metres.
  double residual_m = 0.0;
};

/// The turn and shift that most ties agree with, by least squares of these. Requires: z is up in
/// both maps. Errors: NOT_FOUND/NO_REGISTRATION where too few agree, or are of too few places, with
/// how many there are. Cost: ties squared.
absl::StatusOr<SessionAlignment> AlignSessions(std::span<const SessionTie> ties,
                                               const SessionAlignmentOptions& options);

}  // namespace dsg::ingest
