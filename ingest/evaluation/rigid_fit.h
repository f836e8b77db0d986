// SPDX-License-Identifier: Apache-2.0
// The motion that brings points best onto others, and the scale if it is unknown.
// Refuses to estimate scale unless asked: a stereo rig knows it.
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
  /// All six and a common scale: what one camera alone leaves open.
  kSim3,
};

/// point_target = scale * target_T_source.orientation * point_source + target_T_source.position.
struct Similarity {
  Pose3d target_T_source;
  double scale = 1.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (target_T_source.orientation * point) + target_T_source.position;
  }
  Pose3d operator*(const Pose3d& pose) const {
    return {*this * pose.position, target_T_source.orientation * pose.orientation};
  }
};

/// The similarity that minimises the sum of |similarity * source - target|^2.
/// SE(3): R = U S V', S = diag(1, 1, det(U V')), of the SVD U D V' of
/// C = sum (t - mean_t)(s - mean_s)'.
/// Yaw: atan2(sum(sx ty - sy tx), sum(sx tx + sy ty)) on centred points.
/// Sim(3): R of SE(3), scale = trace(D S) / sum |s - mean_s|^2; 1 where all sources are one point.
///
/// Requires: as many targets as sources, at least one.
/// Source: Umeyama 1991; Zhang and Scaramuzza 2018 (4-DoF).
Similarity FitSimilarity(const std::vector<Eigen::Vector3d>& source,
                         const std::vector<Eigen::Vector3d>& target, Alignment alignment);

/// Its motion. Requires: not kSim3, whose motion says nothing without the scale.
Pose3d FitRigid(const std::vector<Eigen::Vector3d>& source,
                const std::vector<Eigen::Vector3d>& target, Alignment alignment);

}  // namespace dsg::evaluation
