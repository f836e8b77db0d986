// SPDX-License-Identifier: Apache-2.0
// Poses and what was measured between them.
// Refuses to know files and solvers.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::ingest {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Where pose `to` is, seen from pose `from`.
struct RelativePose {
  /// Indices into PoseGraph::poses.
  int from = 0;
  int to = 0;
  Pose3d from_T_to;
  /// Of the residual [R_z' (R_i' (t_j - t_i) - t_z); Log(R_z' R_i' R_j)], metres and radians,
  /// translation before rotation; symmetric positive definite.
  Matrix6d information = Matrix6d::Identity();
  /// A loop closure, which may be wrong; odometry is trusted.
  bool is_loop = false;
  /// Where it stood in its file; 0 = nowhere.
  int64_t line = 0;
};

struct PoseGraph {
  /// Planar graphs move in x, y and yaw only; information is of x, y and yaw (rows 0, 1 and 5), the
  /// rest is ignored.
  bool is_planar = false;
  /// As the file named them, strictly ascending.
  std::vector<int64_t> ids;
  /// map_T_pose.
  std::vector<Pose3d> poses;
  std::vector<RelativePose> edges;
};

/// A number of a pose, edge or set as an index; requires i >= 0.
inline size_t Index(int i) { return static_cast<size_t>(i); }

}  // namespace dsg::ingest
