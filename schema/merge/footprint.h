// SPDX-License-Identifier: Apache-2.0
// Floor plans as polygons: shared area, union, heights. Self-intersecting outlines are repaired or
// replaced by their convex hull.
#pragma once

#include "schema/model/node.h"

namespace dsg::merge {

/// Area that both cover, square metres.
double SharedArea(const Polygon2d& a, const Polygon2d& b);

/// The union of both; the hull of both where they do not touch.
Polygon2d UnionOf(const Polygon2d& a, const Polygon2d& b);

/// The footprint of a region in the map, or the rectangle of its box; empty without either.
Polygon2d FootprintOf(const Node& node);

/// The heights of a region, or of its box without them.
struct HeightSpan {
  double z_min_m = 0.0;
  double z_max_m = 0.0;
};
HeightSpan HeightsOf(const Node& node);

}  // namespace dsg::merge
