// SPDX-License-Identifier: Apache-2.0
// Where things of a map lie in a picture seen from above: north (y) up, one scale.
#pragma once

#include <Eigen/Geometry>

#include "schema/model/geometry.h"

namespace dsg::cli {

class FloorView {
 public:
  /// `bounds_map` becomes a part of the picture that is as large as `area_px` allows; the rest of
  /// the area is left out. Requires: both have an extent.
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
  /// Pixel row below the lowest part of the map.
  double bottom_px() const { return low_px_.y() + px_per_m_ * bounds_map_.sizes().y(); }

 private:
  Eigen::AlignedBox2d bounds_map_;
  double px_per_m_;
  Eigen::Vector2d low_px_;
};

}  // namespace dsg::cli
