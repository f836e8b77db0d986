// SPDX-License-Identifier: Apache-2.0
// How sure the measurements that are believed make one pose against another, at least.
// Refuses to compute the exact covariance: the best single path bounds it, and costs far less.
#pragma once

#include <optional>
#include <vector>

#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

class BelievedPaths {
 public:
  /// `map_T_pose` and `is_believed` by pose and by edge. All must outlive this.
  /// Requires: edges within the poses.
  BelievedPaths(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                const std::vector<bool>& is_believed);

  /// For each target the covariance of the way to it, twist of the map's frame; none where no path
  /// leads.
  /// Cost: that of Dijkstra's search, until all targets are reached.
  std::vector<std::optional<Matrix6d>> CovariancesFrom(int source,
                                                       const std::vector<int>& targets) const;

 private:
  struct Step {
    int there = 0;
    int edge = 0;
    double length = 0.0;
  };
  /// The edge by which the best path reaches each pose, -1 at its beginning and where none leads.
  std::vector<int> Search(int source, const std::vector<int>& targets) const;

  const PoseGraph& graph_;
  std::vector<std::vector<Step>> steps_of_;
  /// By edge, twist of the map's frame.
  std::vector<Matrix6d> covariances_;
};

}  // namespace dsg::ingest
