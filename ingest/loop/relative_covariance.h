// SPDX-License-Identifier: Apache-2.0
// How sure a set of measurements makes one pose against another, all of them taken together.
// Refuses to be cheap: believed_paths.h bounds it for less.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

/// To first order a pose graph is a network of resistors: edges add twists of the map's frame, and
/// the covariance between two poses is the resistance between them, a matrix for a number.
///
/// Threads: one caller at a time.
/// Cost:    the first question factorises the network; each one goes through the part of the factor
///          that belongs to its two poses, some hundredths of it in a large graph.
class RelativeCovariances {
 public:
  /// `map_T_pose` and `is_believed` by pose and by edge. All must outlive this.
  /// Requires: edges within the poses, information matrices positive definite.
  RelativeCovariances(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                      const std::vector<bool>& is_believed);
  ~RelativeCovariances();

  /// Twist of the map's frame; zeros in the directions that a planar graph has not. None if no
  /// believed edges join the two poses, or where numbers fail.
  std::optional<Matrix6d> Between(int from, int to);

 private:
  struct Network;
  void Factorise();

  const PoseGraph& graph_;
  const std::vector<Pose3d>& map_T_pose_;
  const std::vector<bool>& is_believed_;
  std::vector<int> parts_;
  std::unique_ptr<Network> network_;
};

/// The covariance of the way between two poses without an edge of covariance `edge`, given that
/// with it, `with`. None if nothing else joins them.
std::optional<Matrix6d> WithoutEdge(const Matrix6d& with, const Matrix6d& edge, bool is_planar);

}  // namespace dsg::ingest
