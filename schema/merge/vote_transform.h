// SPDX-License-Identifier: Apache-2.0
// Guesses at the transform between two upright maps: where many pairs of landmarks agree.
// Refuses to decide: the guesses are coarse, and the best of them may be wrong.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/landmarks.h"

namespace dsg::merge {

/// into = Rz(yaw) other + shift, to about a metre and the step of the yaw.
struct Guess {
  double yaw_rad = 0.0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double votes = 0.0;
};

struct VoteOptions {
  double yaw_step_rad = 0.0349;
  double cell_m = 0.5;
  int guess_count_max = 40;
};

/// The guesses with the most votes, best first, no two of them near each other.
///
/// Cost: pairs of the same kind times steps of the yaw.
/// Errors: what `stop` returned.
absl::StatusOr<std::vector<Guess>> VoteOnTransform(const std::vector<Landmark>& into,
                                                   const std::vector<Landmark>& other,
                                                   const VoteOptions& options,
                                                   const StopCheck& stop);

}  // namespace dsg::merge
