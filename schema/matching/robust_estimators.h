// SPDX-License-Identifier: Apache-2.0
// Robust estimates from measurements most of which may be wrong: a scalar by adaptive voting, a
// rotation by graduated non-convexity. Neither needs an initial guess.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dsg {

struct Measurement {
  double value = 0.0;
  /// Largest error of a true measurement. Requires: above zero.
  double bound = 1.0;
};

struct Vote {
  double value = 0.0;
  /// Sum over measurements of min((miss / bound)^2, 1).
  double cost = 0.0;
};

/// Minimises the truncated least squares exactly: the consensus set changes only where the interval
/// of a measurement begins or ends, so all possible sets are tried. {0, 0} without measurements.
///
/// Requires: finite values and bounds.
/// Cost: n log n.
/// Source: Yang, Shi and Carlone, 2021, adaptive voting.
Vote VoteAdaptively(const std::vector<Measurement>& measurements);

/// Vectors as columns.
using Columns = Eigen::Matrix3Xd;

struct GncOptions {
  /// Largest error of a true pair.
  double bound = 0.1;
  double factor = 1.4;
  int iteration_count_max = 100;
  /// Relative change of the cost at convergence.
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
