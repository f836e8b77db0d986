// SPDX-License-Identifier: Apache-2.0
// Points, segments, triangles and boxes, and the distance between any two of them, in closed form.
// Refuses to iterate: what is exact cannot fail to converge.
#pragma once

#include <Eigen/Core>
#include <array>

#include "schema/model/geometry.h"

namespace dsg::query {

/// A convex set of 1 (point), 2 (segment), 3 (triangle) or 8 corners (box). Triangles and segments
/// may be degenerate.
struct Convex {
  int corner_count = 1;
  std::array<Eigen::Vector3d, 8> corners;
  /// Of boxes only: columns of `axes` are unit vectors along its edges.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  /// Bounds of the corners.
  Box3d bounds;
};

Convex MakePoint(const Eigen::Vector3d& point);
Convex MakeSegment(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
Convex MakeTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
/// Requires: the box is not empty.
Convex MakeBox(const Pose3d& map_T_box, const Box3d& box);

struct ClosestPair {
  double distance_m = 0.0;
  /// Where they are nearest; a common point if they touch.
  Eigen::Vector3d on_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d on_second = Eigen::Vector3d::Zero();
};

/// 0 if they touch or one holds the other.
ClosestPair Distance(const Convex& first, const Convex& second);

/// The nearest point of `set`; the point itself if inside.
Eigen::Vector3d NearestPoint(const Convex& set, const Eigen::Vector3d& point);

/// 0 if they touch.
double DistanceBetween(const Box3d& first, const Box3d& second);

/// The smallest fraction of the way from `from` to `to` at which a point is within `reach_m` of
/// `set`. Requires: it is so somewhere on the way.
double FirstWithin(const Convex& set, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                   double reach_m);

}  // namespace dsg::query
