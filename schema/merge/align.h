// SPDX-License-Identifier: Apache-2.0
// Estimates the transform from another map to this one from what both have seen. Buildings repeat,
// so there is no answer when two transforms explain the maps equally well.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"

namespace dsg::merge {

struct AlignOptions {
  /// Largest distance between two sightings of one thing, metres.
  double noise_bound_m = 0.35;
  /// Fewest agreeing landmarks.
  int agreeing_count_min = 4;
  /// Below this number of things in either map, rooms and places count as landmarks too.
  int few_things = 12;
  /// Limits for the best other transform, relative to the best one: its score, and its number of
  /// agreeing things. Maps of different buildings have many transforms of similar score.
  double rival_share_max = 0.75;
  double rival_count_share_max = 0.6;
  /// A looser limit on agreeing things where nothing contradicts the best transform: most landmarks
  /// that both maps could have seen agree, and hardly any places stand in walls.
  double clean_agreeing_share_min = 0.6;
  double clean_blocked_share_max = 0.05;
  int clean_walled_count_min = 20;
  double clean_rival_count_share_max = 0.9;
  /// Largest probability that unrelated maps agree as well as these do.
  double chance_max = 0.001;
  /// Least share of agreeing landmarks among those that both maps could have seen.
  double agreeing_share_min = 0.25;
  /// Largest share of places that stand in walls, among those near walls of the other map.
  double blocked_share_max = 0.15;
};

/// Threads: plain values.
struct Alignment {
  Pose3d map_T_other;
  /// Root mean square distance of the landmarks that agree, metres.
  double residual_m = 0.0;
  int agreeing_count = 0;
  /// Landmarks of either map that lie where the other map has been.
  int shared_count = 0;
  /// Score of the best transform elsewhere, relative to this one; 0 = there is none.
  double rival_share = 0.0;
  /// Rotation (rad, small turns about the axes of the other frame) before translation (m); tilts
  /// are 0.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Votes of landmark pairs give candidates, and registration refines each. The score compares
/// agreeing landmarks with contradictions: things missing where both maps looked, places inside
/// walls.
///
/// Requires: z is up in both frames.
/// Errors: NOT_FOUND/NO_REGISTRATION saying how many agreed or which two transforms are alike; what
/// `stop` returned.
/// Source: TEASER (Yang, Shi and Carlone, 2021) for the registration of each candidate.
absl::StatusOr<Alignment> EstimateTransform(const MapContent& into, const MapContent& other,
                                            const AlignOptions& options, const StopCheck& stop);

/// Evidence for and against a transform, whatever its origin.
struct Evidence {
  int agreeing_count = 0;
  /// Landmarks of either map that the other lacks although it has been there.
  int missing_count = 0;
  /// Share of places that stand in walls, among those near walls of the other map; 0 to 1.
  double blocked_share = 0.0;
};

Evidence EvidenceFor(const MapContent& into, const MapContent& other, const Pose3d& map_T_other,
                     const AlignOptions& options);

}  // namespace dsg::merge
