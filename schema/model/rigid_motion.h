// SPDX-License-Identifier: Apache-2.0
// Rigid motion of what a map holds: nodes, poses with their covariance, factors, mesh.
//
// `new_T_old` takes points from the old frame of the map to the new one. It keeps z up, except for
// small tilts: floor plans are seen from above in both frames.
#pragma once

#include "schema/model/edge.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg {

/// Angle between the vertical axes of both frames, radians in [0, pi].
double TiltOf(const Pose3d& new_T_old);

/// Moves all that a node states in the frame of the map: its pose, the pose of its CAD model, its
/// plane, its floor plan and heights. Boxes are in the frame of the node and stay.
void TransformNode(const Pose3d& new_T_old, Node* node);

/// Moves pose and covariance. The orientation of a pose with kNoOrientation stays the identity.
void TransformPose(const Pose3d& new_T_old, TimedPose* pose);

/// The covariance of a pose whose map turns: translation is in the axes of the map and turns,
/// rotation is in the axes of the agent and stays. See Covariance6.
Covariance6 TransformCovariance(const Eigen::Quaterniond& new_R_old, const Covariance6& covariance);

/// Moves a prior on one pose (from == to), which is a pose in the map, with its information.
/// Relative poses stay.
void TransformFactor(const Pose3d& new_T_old, PoseFactor* factor);

/// Moves vertices and normals. Index and faces stay: the caller cuts the mesh into blocks anew.
void TransformMesh(const Pose3d& new_T_old, MeshBlock* block);

}  // namespace dsg
