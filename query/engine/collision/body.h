// SPDX-License-Identifier: Apache-2.0
// What is asked about: a rigid shape at a pose or on its way.
// Refuses to check numbers from outside: that is done where they come in.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "query/engine/collision/triangle_tree.h"
#include "schema/model/geometry.h"

namespace dsg::query {

/// A shape in its own frame. All numbers finite; sizes and radii positive, lengths not negative.
struct Body {
  enum class Kind { kSphere, kCuboid, kCapsule, kMesh };
  Kind kind = Kind::kSphere;
  /// Of spheres and capsules.
  double radius_m = 0.0;
  /// Edges of cuboids, centred.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Of the axis of capsules, along z, centred.
  double length_m = 0.0;
  /// Of meshes: a surface without inside.
  std::shared_ptr<const TriangleTree> mesh;
  /// map_T_body, at least one. Several: along straight lines, orientations interpolated.
  std::vector<Pose3d> poses;
};

/// A sphere that moves from point to point. Requires: at least one point, a positive radius.
Body SweptSphere(double radius_m, const std::vector<Eigen::Vector3d>& points_map);

}  // namespace dsg::query
