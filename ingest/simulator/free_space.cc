// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/free_space.h"

#include <algorithm>
#include <limits>

namespace dsg::simulator {
namespace {

// Slab test: does the segment have a point in common with the rectangle?
bool SegmentTouches(const Point& from, const Point& to, const Rect& rect) {
  double enter = 0.0;
  double leave = 1.0;
  const Point step = to - from;
  for (int axis = 0; axis < 2; ++axis) {
    if (step[axis] == 0.0) {
      if (from[axis] < rect.min()[axis] || from[axis] > rect.max()[axis]) return false;
      continue;
    }
    const double a = (rect.min()[axis] - from[axis]) / step[axis];
    const double b = (rect.max()[axis] - from[axis]) / step[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

double DistanceToSegment(const Point& point, const Point& from, const Point& to) {
  const Point step = to - from;
  const double length_squared = step.squaredNorm();
  if (length_squared == 0.0) return (point - from).norm();
  const double along = std::clamp((point - from).dot(step) / length_squared, 0.0, 1.0);
  return (point - from - along * step).norm();
}

}  // namespace

double DistanceToRect(const Point& point, const Rect& rect) { return rect.exteriorDistance(point); }

double SegmentDistanceToRect(const Point& from, const Point& to, const Rect& rect) {
  if (SegmentTouches(from, to, rect)) return 0.0;
  // Apart, the nearest pair holds an end of the segment or a corner of the rectangle.
  double nearest = std::min(DistanceToRect(from, rect), DistanceToRect(to, rect));
  for (const Point& corner : {rect.min(), rect.max(), Point(rect.min().x(), rect.max().y()),
                              Point(rect.max().x(), rect.min().y())}) {
    nearest = std::min(nearest, DistanceToSegment(corner, from, to));
  }
  return nearest;
}

Rect Inflate(const Rect& rect, double margin_m) {
  const Point margin(margin_m, margin_m);
  return Rect(rect.min() - margin, rect.max() + margin);
}

double FreeSpace::Clearance(const Point& point) const {
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (const Rect& obstacle : obstacles_) {
    nearest_squared = std::min(nearest_squared, obstacle.squaredExteriorDistance(point));
  }
  return std::sqrt(nearest_squared);
}

double FreeSpace::SegmentClearance(const Point& from, const Point& to) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Rect& obstacle : obstacles_) {
    nearest = std::min(nearest, SegmentDistanceToRect(from, to, obstacle));
  }
  return nearest;
}

bool FreeSpace::SegmentKeepsClear(const Point& from, const Point& to, double radius_m) const {
  const Rect reach = Inflate(Rect(from.cwiseMin(to), from.cwiseMax(to)), radius_m);
  for (const Rect& obstacle : obstacles_) {
    if (!reach.intersects(obstacle)) continue;
    if (SegmentDistanceToRect(from, to, obstacle) < radius_m) return false;
  }
  return true;
}

}  // namespace dsg::simulator
