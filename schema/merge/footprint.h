// SPDX-License-Identifier: Apache-2.0
// Floor plans as polygons: shared area, union, heights. Self-intersecting outlines are repaired or
// replaced by their convex hull.
#pragma once

#include "schema/model/node.h"

namespace dsg::merge {

/// Square metres; 0 for less than three corners.
double AreaOf(const Polygon2d& outline);

/// Square metres that both cover.
double SharedArea(const Polygon2d& a, const Polygon2d& b);

/// Around both; where they do not touch, the hull of both.
Polygon2d UnionOf(const Polygon2d& a, const Polygon2d& b);

/// The footprint of a region in the map, or the rectangle of its box; empty without either.
Polygon2d FootprintOf(const Node& node);

/// Of the vertical: a region's own heights, or those of its box.
struct HeightSpan {
  double z_min_m = 0.0;
  double z_max_m = 0.0;
};
HeightSpan HeightsOf(const Node& node);

}  // namespace dsg::merge
