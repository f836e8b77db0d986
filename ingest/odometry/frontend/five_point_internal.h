// SPDX-License-Identifier: Apache-2.0
// Motions that five pairs of bearings allow.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "ingest/odometry/frontend/relative_pose.h"

namespace dsg::ingest {

/// A rotation first_R_second and a unit translation, the second camera's place in the first frame.
struct TurnAndWay {
  Eigen::Matrix3d turn;
  Eigen::Vector3d way;
};

/// All motions with first' * [way]x * turn * second = 0 for five pairs: up to ten essential
/// matrices, each of four motions, whatever side of the cameras the points are on. Empty where the
/// solver finds none. Requires: five pairs, z > 0.
std::vector<TurnAndWay> FivePointMotions(std::span<const BearingPair> five);

}  // namespace dsg::ingest
