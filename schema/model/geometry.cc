// SPDX-License-Identifier: Apache-2.0
#include "schema/model/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dsg {

bool IsValidPose(const Pose3d& pose) {
  return pose.position.allFinite() && pose.orientation.coeffs().allFinite() &&
         std::abs(pose.orientation.norm() - 1.0) <= 1e-6;
}

Pose3d Interpolate(const Pose3d& from, const Pose3d& to, double fraction) {
  return {from.position + fraction * (to.position - from.position),
          from.orientation.slerp(fraction, to.orientation).normalized()};
}

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond difference = a.conjugate() * b;
  return 2.0 * std::atan2(difference.vec().norm(), std::abs(difference.w()));
}

Box3d TransformBox(const Pose3d& map_T_node, const Box3d& box_node) {
  if (box_node.isEmpty()) return Box3d();
  const Eigen::Matrix3d rotation = map_T_node.orientation.toRotationMatrix();
  const Eigen::Vector3d center = map_T_node * box_node.center();
  const Eigen::Vector3d half = rotation.cwiseAbs() * (0.5 * box_node.sizes());
  return Box3d(center - half, center + half);
}

double DistanceToBox(const Eigen::Vector3d& point, const Box3d& box) {
  return std::sqrt(box.squaredExteriorDistance(point));
}

double DistanceToBox(const Eigen::Vector3d& point_map, const Pose3d& map_T_node,
                     const Box3d& box_node) {
  if (box_node.isEmpty()) return DistanceToBox(point_map, Box3d(map_T_node.position));
  if (map_T_node.orientation.coeffs() == Eigen::Quaterniond::Identity().coeffs()) {
    return DistanceToBox(point_map, TransformBox(map_T_node, box_node));
  }
  return DistanceToBox(map_T_node.Inverse() * point_map, box_node);
}

bool PolygonContains(const Polygon2d& polygon, const Eigen::Vector2d& point) {
  bool inside = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[j];
    if ((a.y() > point.y()) != (b.y() > point.y()) &&
        point.x() < (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y()) + a.x()) {
      inside = !inside;
    }
  }
  return inside;
}

double SignedArea(const Polygon2d& polygon) {
  double twice = 0.0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    // From the first corner: far from the origin the products would swallow the area.
    const Eigen::Vector2d a = polygon[i] - polygon[0];
    const Eigen::Vector2d b = polygon[(i + 1) % polygon.size()] - polygon[0];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return 0.5 * twice;
}

double SignedDistanceToPolygon(const Polygon2d& polygon, const Eigen::Vector2d& point) {
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d edge = polygon[i] - polygon[j];
    const double length_squared = edge.squaredNorm();
    const double along =
        length_squared == 0.0
            ? 0.0
            : std::clamp((point - polygon[j]).dot(edge) / length_squared, 0.0, 1.0);
    nearest_squared = std::min(nearest_squared, (point - polygon[j] - along * edge).squaredNorm());
  }
  const double distance = std::sqrt(nearest_squared);
  return PolygonContains(polygon, point) ? -distance : distance;
}

}  // namespace dsg
