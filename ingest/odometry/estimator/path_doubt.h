// SPDX-License-Identifier: Apache-2.0
// What a path may be off by where unit and images told two motions, and nobody knows which is
// right.
#pragma once

#include <Eigen/Core>

#include "ingest/solver/pose_block.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// All that is told after a doubt may be shifted, and turned about the vertical at the place of the
/// doubt; other tilts are seen by gravity. Doubts add up, as of independent errors.
/// Threads: one caller at a time.
class PathDoubt {
 public:
  /// Standard deviations: of each axis of the position, metres, and of the heading, radians.
  void Add(const Eigen::Vector3d& position_map, double way_m, double turn_rad);

  /// What the covariance of a pose grows by; rows as in the step of a pose block.
  Matrix6d At(const Pose3d& map_T_body) const;

 private:
  // Of the shift at the map's origin and the heading.
  Eigen::Matrix4d covariance_ = Eigen::Matrix4d::Zero();
};

}  // namespace dsg::ingest
