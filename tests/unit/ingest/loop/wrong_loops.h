// SPDX-License-Identifier: Apache-2.0
// Spoils pose graphs with loops that never were, and measures what a solver made of it.
// Refuses to touch the edges that were there.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

struct WrongLoopOptions {
  /// Of all loops, after adding.
  double share = 0.3;
  /// Runs of so many wrong loops between successive poses that agree with one another, as two
  /// corridors that look alike make them; 1 = each by itself.
  int group_size = 1;
  uint64_t seed = 1;
};

/// `graph` with wrong loops after its own edges: random pairs of poses, the one thought to be at a
/// random place of the map at a random angle; information as the median true loop's. What agrees
/// with `true_poses` at a squared residual below `right_below` is drawn again: it is not wrong.
PoseGraph WithWrongLoops(const PoseGraph& graph, const std::vector<Pose3d>& true_poses,
                         double right_below, const WrongLoopOptions& options);

/// Root mean square distance of positions after the best rigid alignment.
double PositionError(const std::vector<Pose3d>& poses, const std::vector<Pose3d>& true_poses);

}  // namespace dsg::ingest
