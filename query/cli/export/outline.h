// SPDX-License-Identifier: Apache-2.0
// Shapes of nodes seen from above, and where they lie in a picture.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "schema/model/geometry.h"
#include "schema/model/node.h"

namespace dsg::cli {

/// Of two vectors in the plane: positive if `b` points to the left of `a`.
inline double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The convex hull, counter-clockwise; fewer corners when the points lie on a line.
Polygon2d ConvexHull(Polygon2d points);

/// Seen from above: the footprint of a region, otherwise the box; empty without either.
Polygon2d FloorOutline(const Node& node);

/// Where the plane of a wall cuts the outline of its box, two points; empty where the box tells as
/// much, since the wall is along its sides. Boxes of walls lie along the axes of the map, which
/// maps of odometry do not share with their buildings.
std::vector<Eigen::Vector2d> SlantedWall(const Node& node);

/// Maps a region seen from above to a picture: north (y) up, one scale.
class FloorView {
 public:
  /// Fits `bounds_map` into `area_px`, with the same scale for both axes. Requires: neither is
  /// empty or flat.
  FloorView(const Eigen::AlignedBox2d& bounds_map, const Eigen::AlignedBox2d& area_px)
      : bounds_map_(bounds_map),
        px_per_m_((area_px.sizes().array() / bounds_map.sizes().array()).minCoeff()),
        low_px_(area_px.min()) {
    low_px_.x() += 0.5 * (area_px.sizes().x() - px_per_m_ * bounds_map.sizes().x());
  }

  double px_per_m() const { return px_per_m_; }
  Eigen::Vector2d ToPixel(const Eigen::Vector2d& point_map) const {
    return low_px_ + px_per_m_ * Eigen::Vector2d(point_map.x() - bounds_map_.min().x(),
                                                 bounds_map_.max().y() - point_map.y());
  }
  Eigen::Vector2d ToPixel(const Eigen::Vector3d& point_map) const {
    return ToPixel(Eigen::Vector2d(point_map.head<2>()));
  }
  Polygon2d ToPixels(const Polygon2d& polygon_map) const {
    Polygon2d pixels;
    pixels.reserve(polygon_map.size());
    for (const Eigen::Vector2d& corner : polygon_map) pixels.push_back(ToPixel(corner));
    return pixels;
  }
  const Eigen::AlignedBox2d& bounds_map() const { return bounds_map_; }
  /// The part of the picture that the region takes.
  Eigen::AlignedBox2d area_px() const {
    return Eigen::AlignedBox2d(low_px_, low_px_ + px_per_m_ * bounds_map_.sizes());
  }

 private:
  Eigen::AlignedBox2d bounds_map_;
  double px_per_m_;
  Eigen::Vector2d low_px_;
};

}  // namespace dsg::cli
