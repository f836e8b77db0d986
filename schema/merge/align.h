// SPDX-License-Identifier: Apache-2.0
// Where another map lies in the frame of this one, from what both have seen.
// Refuses to choose between two answers that are as good as each other: buildings repeat.
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
  /// The second best answer must score less than this share of the best.
  double rival_share_max = 0.75;
  /// How often maps of strangers may agree as well as these do.
  double chance_max = 0.01;
  /// Of what both maps could have seen, at least this share was found in both.
  double agreeing_share_min = 0.3;
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

}  // namespace dsg::merge
