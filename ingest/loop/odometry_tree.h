// SPDX-License-Identifier: Apache-2.0
// Where odometry alone puts each pose, and how sure it is of one pose against another.
// Refuses to look at loops; odometry that goes round in a circle is used by its shortest ways only.
#pragma once

#include <vector>

#include "ingest/loop/pose_graph.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A tree of least depth over the edges that are no loops, one for each part that hangs together.
class OdometryTree {
 public:
  /// Requires: edges within the poses.
  explicit OdometryTree(const PoseGraph& graph);

  /// Parts are numbered from 0 by first pose.
  int part(int pose) const { return part_[Index(pose)]; }
  /// The first pose of each part is its frame.
  const Pose3d& part_T_pose(int pose) const { return part_T_pose_[Index(pose)]; }

  /// Covariance of the way from one pose to another, twist of the part's frame.
  /// Requires: both of one part.
  /// Cost: O(1).
  Matrix6d CovarianceBetween(int a, int b) const;
  /// Trace of the rotation's share of it, which no change of frame alters. No less than the
  /// difference of RotationVarianceOf.
  double RotationVarianceBetween(int a, int b) const;
  /// The same of the way from the first pose of the part.
  double RotationVarianceOf(int pose) const { return rotation_variance_[Index(pose)]; }

 private:
  static size_t Index(int i) { return static_cast<size_t>(i); }
  int MeetingPose(int a, int b) const;
  void Grow(const PoseGraph& graph);
  void NumberInDepthOrder();

  std::vector<int> part_;
  std::vector<Pose3d> part_T_pose_;
  /// Sums of edge covariances from the root of the part.
  std::vector<Matrix6d> covariance_;
  std::vector<double> rotation_variance_;
  std::vector<int> parent_;
  /// In the order in which the trees grew: parents first.
  std::vector<int> grown_;
  /// Place of each pose in depth-first order, and for each power of two the pose nearest to the
  /// root among the parents of so many successive places.
  std::vector<int> place_;
  std::vector<std::vector<int>> shallowest_;
  std::vector<int> depth_;
};

}  // namespace dsg::ingest
