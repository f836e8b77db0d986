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
  /// Two sightings of one thing are no further apart than this, metres.
  double noise_bound_m = 0.35;
  /// Fewer landmarks that agree are no proof.
  int agreeing_count_min = 4;
  /// Where maps have fewer things than this, rooms and places help.
  int few_things = 12;
  /// Whatever lies elsewhere must score less than this share of the best, and fewer things than
  /// this share of its may agree: maps of strangers have many answers that are alike.
  double rival_share_max = 0.75;
  double rival_count_share_max = 0.6;
  /// Where nothing speaks against an answer, that is where so many of what both could have seen are
  /// found and next to no places stand in walls, more things may agree elsewhere.
  double clean_agreeing_share_min = 0.6;
  double clean_blocked_share_max = 0.05;
  int clean_walled_count_min = 20;
  double clean_rival_count_share_max = 0.9;
  /// How often maps of strangers may agree as well as these do.
  double chance_max = 0.001;
  /// Of what both maps could have seen, at least this share was found in both.
  double agreeing_share_min = 0.25;
  /// Of the places near walls of the other map, no more than this share stand in them.
  double blocked_share_max = 0.15;
};

/// Threads: plain values.
struct Alignment {
  Pose3d map_T_other;
  /// Root mean square distance of the landmarks that agree, metres.
  double residual_m = 0.0;
  int agreeing_count = 0;
  /// Landmarks of either map that lie where the other has been too.
  int shared_count = 0;
  /// Score of the best answer elsewhere, against this one; 0 = there is none.
  double rival_share = 0.0;
  /// Of rotation (rad) and translation (m), small turns of the other frame's axes; tilts are 0.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Votes of pairs of landmarks give guesses, registration makes each of them exact, and what agrees
/// against what does not (things missing where both maps looked, places inside walls) chooses.
///
/// Requires: z is up in both frames.
/// Errors: NOT_FOUND/NO_REGISTRATION saying how many agreed or which two answers are alike; what
/// `stop` returned.
/// Source: TEASER (Yang, Shi and Carlone, 2021) for the registration of each guess.
absl::StatusOr<Alignment> EstimateTransform(const MapContent& into, const MapContent& other,
                                            const AlignOptions& options, const StopCheck& stop);

/// What speaks for a transform, whoever gave it, and what against it.
struct Evidence {
  int agreeing_count = 0;
  /// Landmarks of either map that the other does not have though it has been there.
  int missing_count = 0;
  /// Of the places near walls of the other map, those that stand in them; 0 to 1.
  double blocked_share = 0.0;
};

Evidence EvidenceFor(const MapContent& into, const MapContent& other, const Pose3d& map_T_other,
                     const AlignOptions& options);

}  // namespace dsg::merge
