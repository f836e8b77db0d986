// SPDX-License-Identifier: Apache-2.0
// The rotation between pairs of vectors, some of which are wrong.
// Refuses a first guess: it starts from a convex problem and makes it truncated step by step.
#pragma once

#include <Eigen/Core>

namespace dsg {

/// Vectors as columns.
using Columns = Eigen::Matrix3Xd;

struct GncOptions {
  /// A true pair misses by no more than this.
  double bound = 0.1;
  double factor = 1.4;
  int iteration_count_max = 100;
  /// Relative change of the cost at which the rotation has settled.
  double tolerance = 1e-6;
  /// About z only.
  bool is_upright = false;
};

struct GncRotation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  /// By column, in [0, 1].
  Eigen::VectorXd weights;
  int iteration_count = 0;
};

/// The rotation R that minimises the sum of weight |b - R a|^2 (Kabsch); about z only when upright.
/// Never a reflection.
Eigen::Matrix3d WeightedRotation(const Columns& a, const Columns& b, const Eigen::VectorXd& weights,
                                 bool is_upright);

/// Minimises the sum of min(|b - R a|^2, bound^2) over rotations R.
///
/// Requires: as many columns in `a` as in `b`, bound above zero.
/// Source: Yang, Antonante, Tzoumas and Carlone, 2020.
GncRotation RotateRobustly(const Columns& a, const Columns& b, const GncOptions& options);

}  // namespace dsg
