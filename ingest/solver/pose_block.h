// SPDX-License-Identifier: Apache-2.0
// A pose as a parameter block of Ceres, alike in all solvers that move poses.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "schema/model/geometry.h"

namespace ceres {
class Manifold;
}

namespace dsg::ingest {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Numbers of a block: position in metres, then the quaternion x, y, z, w.
inline constexpr int kPoseBlockSize = 7;
/// Numbers of a step: of the position along the axes of the map, metres, then a turn on the right
/// of the orientation, radians.
inline constexpr int kPoseStepSize = 6;

Pose3d PoseOfBlock(const double* block);
void WritePoseBlock(const Pose3d& pose, double* block);

/// The pose after a step; its quaternion is unit.
Pose3d Stepped(const Pose3d& pose, const Vector6d& step);
/// The step that leads from one pose to the other; the turn is at most pi.
Vector6d StepBetween(const Pose3d& from, const Pose3d& to);

/// Stepped and StepBetween, as Ceres wants them.
///
/// Cost functions write the derivative by the step into the first six of the block's seven columns
/// and zeros into the last one, so that quaternions are never differentiated. What Ceres
/// differentiates by itself (AutoDiffCostFunction) must not share such a block.
std::unique_ptr<ceres::Manifold> MakePoseManifold();

}  // namespace dsg::ingest
