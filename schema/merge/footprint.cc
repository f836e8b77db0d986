// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/footprint.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <optional>

namespace dsg::merge {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point>;
using MultiPolygon = bg::model::multi_polygon<Polygon>;

// Snapping to millimetres makes the overlay robust to nearly parallel sides.
double Snapped(double metres) { return std::round(metres * 1000.0) / 1000.0; }

Polygon Hull(const Polygon& polygon) {
  Polygon hull;
  bg::convex_hull(polygon, hull);
  return hull;
}

Polygon ToBoost(const Polygon2d& outline) {
  Polygon polygon;
  for (const Eigen::Vector2d& corner : outline) {
    bg::append(polygon.outer(), Point(Snapped(corner.x()), Snapped(corner.y())));
  }
  bg::correct(polygon);
  return bg::is_valid(polygon) ? polygon : Hull(polygon);
}

Polygon2d FromBoost(const Polygon& polygon) {
  Polygon2d outline;
  for (const Point& corner : polygon.outer()) outline.emplace_back(corner.x(), corner.y());
  // Boost repeats the first corner at the end, and turns clockwise.
  if (!outline.empty()) outline.pop_back();
  std::reverse(outline.begin(), outline.end());
  return outline;
}

Polygon2d RectangleOf(const Box3d& box) {
  const Eigen::Vector3d& low = box.min();
  const Eigen::Vector3d& high = box.max();
  return {low.head<2>(), {high.x(), low.y()}, high.head<2>(), {low.x(), high.y()}};
}

// nullopt for outlines that the overlay rejects.
std::optional<double> TryShared(const Polygon& a, const Polygon& b) {
  try {
    MultiPolygon shared;
    bg::intersection(a, b, shared);
    return bg::area(shared);
  } catch (const bg::exception&) {
    return std::nullopt;
  }
}

}  // namespace

double SharedArea(const Polygon2d& a, const Polygon2d& b) {
  if (a.size() < 3 || b.size() < 3) return 0.0;
  const Polygon first = ToBoost(a);
  const Polygon second = ToBoost(b);
  const std::optional<double> shared = TryShared(first, second);
  if (shared.has_value()) return *shared;
  return TryShared(Hull(first), Hull(second)).value_or(0.0);
}

Polygon2d UnionOf(const Polygon2d& a, const Polygon2d& b) {
  if (a.size() < 3) return b;
  if (b.size() < 3) return a;
  try {
    MultiPolygon both;
    bg::union_(ToBoost(a), ToBoost(b), both);
    if (both.size() == 1) {
      Polygon slim;
      bg::simplify(both.front(), slim, 0.02);
      return FromBoost(bg::is_valid(slim) && slim.outer().size() > 3 ? slim : both.front());
    }
  } catch (const bg::exception&) {
    // Falls through to the hull of both.
  }
  Polygon corners;
  for (const Polygon2d* outline : {&a, &b}) {
    for (const Eigen::Vector2d& corner : *outline) {
      bg::append(corners.outer(), Point(corner.x(), corner.y()));
    }
  }
  return FromBoost(Hull(corners));
}

Polygon2d FootprintOf(const Node& node) {
  if (node.region.has_value() && node.region->footprint_map.size() >= 3) {
    return node.region->footprint_map;
  }
  if (node.box_node.isEmpty()) return {};
  const Box3d box = node.BoxMap();
  return box.sizes().head<2>().minCoeff() > 0.0 ? RectangleOf(box) : Polygon2d();
}

HeightSpan HeightsOf(const Node& node) {
  if (node.region.has_value() && node.region->z_max_m > node.region->z_min_m) {
    return {node.region->z_min_m, node.region->z_max_m};
  }
  const Box3d box = node.BoxMap();
  return {box.min().z(), box.max().z()};
}

}  // namespace dsg::merge
