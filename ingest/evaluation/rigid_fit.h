// SPDX-License-Identifier: Apache-2.0
// The rigid motion that brings points best onto others.
// Refuses to estimate scale.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::evaluation {

inline constexpr double kDegreesPerRadian = 180.0 / M_PI;

enum class Alignment {
  kNone,
  /// All six degrees of freedom.
  kSe3,
  /// Yaw and translation: what an estimator that feels gravity leaves open.
  kYaw,
};

/// target_T_source that minimises the sum of |target_T_source * source - target|^2.
/// SE(3): R = U diag(1, 1, det(U V')) V' of the SVD of C = sum (t - mean_t)(s - mean_s)'.
/// Yaw: atan2(sum(sx ty - sy tx), sum(sx tx + sy ty)) on centred points.
///
/// Requires: as many targets as sources, at least one.
/// Source: Umeyama 1991; Zhang and Scaramuzza 2018 (4-DoF).
Pose3d FitRigid(const std::vector<Eigen::Vector3d>& source,
                const std::vector<Eigen::Vector3d>& target, Alignment alignment);

}  // namespace dsg::evaluation
