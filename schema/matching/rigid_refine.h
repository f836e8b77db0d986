// SPDX-License-Identifier: Apache-2.0
// The best motion on correspondences that are known to be right, and how sure it is.
// Refuses outliers: who is in is decided elsewhere.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "schema/matching/gnc_rotation.h"

namespace dsg {

struct Motion {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Columns operator*(const Columns& points) const {
    return (scale * (rotation * points)).colwise() + translation;
  }
};

/// Which parts of a motion are free.
struct MotionKind {
  bool is_scaled = false;
  /// Turns about z only.
  bool is_upright = false;
};

/// Least squares over all columns; `scale` when the kind's scale is not free.
///
/// Source: Umeyama, 1991.
Motion FitMotion(const Columns& sources, const Columns& targets, const MotionKind& kind,
                 double scale);

/// Of a small turn of the body (rad, applied before the rotation) and a shift (m); zero where the
/// kind leaves no freedom. The variance of the noise comes from the misses.
///
/// Requires: at least three columns, two if upright.
Eigen::Matrix<double, 6, 6> MotionCovariance(const Columns& sources, const Columns& targets,
                                             const Motion& motion, const MotionKind& kind);

/// Root mean square distance from the mean, in the direction in which the points spread least among
/// those the rotation needs: across their main line, or horizontally when upright.
double SpreadForRotation(const Columns& points, bool is_upright);

std::vector<double> Misses(const Columns& sources, const Columns& targets, const Motion& motion);

}  // namespace dsg
