// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/outline.h"

#include <algorithm>
#include <cmath>

#include "query/cli/export/map_content.h"
#include "schema/picture/wire.h"

namespace dsg::cli {
namespace {

// One side of the hull over points in order of x.
template <class Iterator>
void AddChain(Iterator begin, Iterator end, Polygon2d* hull) {
  const size_t first = hull->size();
  for (Iterator it = begin; it != end; ++it) {
    while (hull->size() >= first + 2 &&
           Cross(hull->back() - hull->end()[-2], *it - hull->back()) <= 0.0) {
      hull->pop_back();
    }
    hull->push_back(*it);
  }
  // The last point begins the next chain.
  hull->pop_back();
}

}  // namespace

Polygon2d ConvexHull(Polygon2d points) {
  const auto less = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  Polygon2d hull;
  AddChain(points.begin(), points.end(), &hull);
  AddChain(points.rbegin(), points.rend(), &hull);
  return hull;
}

Polygon2d FloorOutline(const Node& node) {
  if (node.region.has_value() && node.region->footprint_map.size() >= 3) {
    return node.region->footprint_map;
  }
  if (node.box_node.isEmpty()) return {};
  Polygon2d points;
  for (const Eigen::Vector3d& corner : BoxCorners(node)) points.push_back(corner.head<2>());
  return ConvexHull(std::move(points));
}

std::vector<Eigen::Vector2d> SlantedWall(const Node& node) {
  const Polygon2d outline = FloorOutline(node);
  if (!node.structure.has_value() || outline.empty()) return {};
  const Eigen::Vector3d& normal = node.structure->plane_normal_map;
  const Eigen::Vector2d level = normal.head<2>();
  constexpr double kAlong = 0.05;
  if (level.cwiseAbs().minCoeff() < kAlong) return {};
  const double offset_m = node.structure->plane_offset_m + normal.z() * MiddleOf(node).z();
  std::vector<Eigen::Vector2d> ends;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& from = outline[i];
    const Eigen::Vector2d& to = outline[(i + 1) % outline.size()];
    const double before_m = level.dot(from) + offset_m;
    const double behind_m = level.dot(to) + offset_m;
    if ((before_m < 0.0) == (behind_m < 0.0)) continue;
    ends.push_back(from + before_m / (before_m - behind_m) * (to - from));
  }
  if (ends.size() != 2) ends.clear();
  return ends;
}

}  // namespace dsg::cli
