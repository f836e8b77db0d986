// SPDX-License-Identifier: Apache-2.0
// The collision questions of our benchmark asked of FCL, with its own trees and defaults.
// Refuses to know maps: it is given shapes.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::bench {

struct PosedBox {
  Pose3d map_T_box;
  Box3d box;
};

/// Threads: one caller at a time.
class FclRival {
 public:
  /// Under one DynamicAABBTreeCollisionManager.
  static std::unique_ptr<FclRival> OfBoxes(const std::vector<PosedBox>& boxes);
  /// Three corners a triangle, as one BVHModel<OBBRSS>. Requires: at least one triangle.
  static std::unique_ptr<FclRival> OfTriangles(const std::vector<Eigen::Vector3d>& corners_map);

  virtual ~FclRival() = default;
  /// Of a sphere, at most `clearance_m_max`; 0 if it touches.
  virtual double Clearance(const Eigen::Vector3d& center_map, double radius_m,
                           double clearance_m_max) = 0;
  /// Whether the sphere touches anything.
  virtual bool Touches(const Eigen::Vector3d& center_map, double radius_m) = 0;
};

}  // namespace dsg::bench
