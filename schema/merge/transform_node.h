// SPDX-License-Identifier: Apache-2.0
// Parts of a map carried into the frame of another.
// Refuses transforms that tilt more than a little: outlines are seen from above in both frames.
#pragma once

#include "schema/model/edge.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg::merge {

/// Beyond this one of the frames has not z up, or the transform is wrong.
inline constexpr double kTiltMaxRad = 0.1;

/// Radians between the vertical axes of both frames.
double TiltOf(const Pose3d& map_T_other);

/// Everything of a node that is said in the frame of the map.
void TransformNode(const Pose3d& map_T_other, Node* node);

/// The covariance, in the axes of the map, turns too.
void TransformPose(const Pose3d& map_T_other, TimedPose* pose);

/// Relative poses stay; a prior on one pose (from == to) is a pose in the map.
void TransformFactor(const Pose3d& map_T_other, PoseFactor* factor);

void TransformMesh(const Pose3d& map_T_other, MeshBlock* block);

}  // namespace dsg::merge
