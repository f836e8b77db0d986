// SPDX-License-Identifier: Apache-2.0
// The surface of some mesh blocks, to ask whether a point lies on it.
// Refuses to change after it is made.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "schema/merge/mesh_join.h"
#include "schema/merge/point_grid.h"

namespace dsg::merge {

/// A point of a surface; the normal is zero when unknown.
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Normals as stored, or from the faces. One a vertex.
std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block);

class SurfaceIndex {
 public:
  SurfaceIndex(std::vector<SurfacePoint> points, const MeshJoinOptions& options);

  /// The nearest point of the surface that `point` lies on, -1 if on none.
  int Find(const SurfacePoint& point) const;

 private:
  static std::vector<Eigen::Vector3d> PositionsOf(const std::vector<SurfacePoint>& points);

  std::vector<SurfacePoint> points_;
  MeshJoinOptions options_;
  double cosine_min_;
  PointGrid grid_;
};

}  // namespace dsg::merge
