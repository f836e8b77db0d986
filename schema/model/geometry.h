// SPDX-License-Identifier: Apache-2.0
// Rigid poses, boxes and outlines. Right-handed, z up, metres, radians.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace dsg {

/// A rigid transform; a variable named `map_T_body` takes points from body to map.
struct Pose3d {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Hamilton, unit.
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return orientation * point + position;
  }
  Pose3d operator*(const Pose3d& other) const {
    return {*this * other.position, orientation * other.orientation};
  }
  Pose3d Inverse() const {
    const Eigen::Quaterniond inverse = orientation.conjugate();
    return {inverse * -position, inverse};
  }
};

/// All seven numbers are finite and the quaternion's norm is within 1e-6 of 1.
bool IsValidPose(const Pose3d& pose);

/// Linear in position, slerp along the shorter arc in rotation. `fraction` in [0, 1].
Pose3d Interpolate(const Pose3d& from, const Pose3d& to, double fraction);

/// Angle of the rotation between two orientations, radians in [0, pi]; accurate near zero.
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Axis-aligned; empty by default.
using Box3d = Eigen::AlignedBox3d;

/// The smallest axis-aligned box in the map that holds `box_node`, a box in frame node.
Box3d TransformBox(const Pose3d& map_T_node, const Box3d& box_node);

/// Distance from a point to a box, 0 inside. Requires: the box is not empty.
double DistanceToBox(const Eigen::Vector3d& point, const Box3d& box);
/// Distance from a point to a box in frame node, turned as the node is, 0 inside; to the node's
/// position if the box is empty.
double DistanceToBox(const Eigen::Vector3d& point_map, const Pose3d& map_T_node,
                     const Box3d& box_node);

/// Corners in order, map frame, z ignored.
using Polygon2d = std::vector<Eigen::Vector2d>;

/// Square metres; negative for corners in clockwise order.
double SignedArea(const Polygon2d& polygon);

/// Inside by the even-odd rule; a point on a low-x or low-y edge counts as inside.
bool PolygonContains(const Polygon2d& polygon, const Eigen::Vector2d& point);

/// Distance to the outline, negative inside. Requires: at least three corners.
double SignedDistanceToPolygon(const Polygon2d& polygon, const Eigen::Vector2d& point);

}  // namespace dsg
