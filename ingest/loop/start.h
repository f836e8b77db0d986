// SPDX-License-Identifier: Apache-2.0
// Poses to begin an optimisation with.
// Refuses to minimise: a start only has to lie in the right valley.
#pragma once

#include <vector>

#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

/// By part (PartsOf) the pose that stays: `fixed_pose` in its own, the first one elsewhere.
std::vector<int> AnchorsOf(const std::vector<int>& parts, int fixed_pose);

/// Poses from edges alone: odometry followed first, loops only where it leaves gaps. Anchors keep
/// their poses.
std::vector<Pose3d> TreeStart(const PoseGraph& graph, const std::vector<double>& weights,
                              const std::vector<int>& anchors);

/// ChordalStart with anchors of the caller's choice.
std::vector<Pose3d> ChordalStartFrom(const PoseGraph& graph, const std::vector<double>& weights,
                                     const std::vector<int>& anchors);

}  // namespace dsg::ingest
