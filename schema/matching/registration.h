// SPDX-License-Identifier: Apache-2.0
// The rigid motion between two point sets, most of whose correspondences may be wrong. The result
// lists its inliers; without enough of them there is none.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg {

/// Index in the source, index in the target.
using Correspondence = std::pair<int, int>;

struct RegistrationOptions {
  /// Largest error of a true pair, metres.
  double noise_bound_m = 0.05;
  /// Estimate the scale; otherwise it is 1.
  bool estimate_scale = false;
  /// The rotation is about z only; both clouds are upright.
  bool is_upright = false;
  /// Graduated non-convexity: growth of the surrogate's parameter, rounds, relative tolerance.
  double gnc_factor = 1.4;
  int gnc_iteration_count_max = 100;
  double gnc_tolerance = 1e-6;
  /// Limit of the clique search, which then returns the largest clique so far. In steps and not in
  /// seconds, so that results do not depend on the machine.
  int64_t clique_step_count_max = 20'000'000;
  int correspondence_count_max = 8000;
};

struct Registration {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  /// Indices of correspondences, ascending.
  std::vector<int> inliers;
  /// Size of the largest consistent set, before rotation and translation were estimated.
  int clique_size = 0;
  /// False when the clique search was cut off; else no consistent set is larger.
  bool is_clique_maximal = true;
  /// Root mean square of the inliers' distances, metres.
  double residual_m = 0.0;
  /// Rotation (rad) before translation (m), from the residuals of the inliers. The rotation error
  /// is a small turn of the source before `rotation` is applied. Zero where nothing was estimated.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

/// target = scale * rotation * source + translation, from correspondences with outliers.
/// Steps: translation-invariant differences, the largest clique of consistent pairs, rotation by
/// graduated non-convexity on truncated least squares, translation (and scale) by adaptive voting,
/// refinement on the inliers. Deterministic.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for indices outside the clouds, points that are not
/// finite, or too many correspondences; NOT_FOUND when fewer than three (two if upright) pairs
/// agree, when those lie in line (upright: above each other), or when less than half of the largest
/// consistent set fits one motion, as with a mirror image.
/// Cost: quadratic in correspondences, n^2 / 8 bytes.
/// Source: Yang, Shi and Carlone, 2021 (TEASER); Yang et al., 2020 (GNC).
absl::StatusOr<Registration> Register(const std::vector<Eigen::Vector3d>& source,
                                      const std::vector<Eigen::Vector3d>& target,
                                      const std::vector<Correspondence>& correspondences,
                                      const RegistrationOptions& options);

/// All pairs of a source point and a target point.
std::vector<Correspondence> AllToAll(int source_count, int target_count);

}  // namespace dsg
