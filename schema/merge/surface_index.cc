// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/surface_index.h"

#include <cmath>
#include <limits>

namespace dsg::merge {

std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block) {
  if (!block.normals_map.empty()) return block.normals_map;
  std::vector<Eigen::Vector3f> normals(block.positions_map.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : block.faces) {
    const Eigen::Vector3f& at = block.positions_map[a];
    const Eigen::Vector3f normal = (block.positions_map[b] - at).cross(block.positions_map[c] - at);
    for (const uint32_t corner : {a, b, c}) normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : normals) {
    const float length = normal.norm();
    if (length > 0.0f) normal /= length;
  }
  return normals;
}

std::vector<Eigen::Vector3d> SurfaceIndex::PositionsOf(const std::vector<SurfacePoint>& points) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(points.size());
  for (const SurfacePoint& point : points) positions.push_back(point.position);
  return positions;
}

SurfaceIndex::SurfaceIndex(std::vector<SurfacePoint> points, const MeshJoinOptions& options)
    : points_(std::move(points)),
      options_(options),
      cosine_min_(std::cos(options.normal_angle_max_rad)),
      grid_(PositionsOf(points_), 0.1) {}

int SurfaceIndex::Find(const SurfacePoint& point) const {
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  grid_.ForEachNear(point.position, options_.near_m + options_.along_m, [&](int i) {
    const SurfacePoint& known = points_[static_cast<size_t>(i)];
    const Eigen::Vector3d offset = point.position - known.position;
    const double squared = offset.squaredNorm();
    if (squared > least || (squared == least && i > nearest)) return;
    const bool has_normals = !known.normal.isZero() && !point.normal.isZero();
    if (has_normals && known.normal.dot(point.normal) < cosine_min_) return;
    const double across = std::abs(offset.dot(known.normal));
    const double along = std::sqrt(std::max(0.0, squared - across * across));
    if (across > options_.near_m || along > options_.along_m) return;
    least = squared;
    nearest = i;
  });
  return nearest;
}

}  // namespace dsg::merge
