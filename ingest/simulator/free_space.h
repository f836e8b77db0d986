// SPDX-License-Identifier: Apache-2.0
// Exact distances on the floor from points and straight walks to rectangular obstacles.
// Refuses to approximate by grids: what it calls clear is clear.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <utility>
#include <vector>

namespace dsg::simulator {

using Point = Eigen::Vector2d;
using Rect = Eigen::AlignedBox2d;

/// Distance between two closed sets, metres, 0 when they touch. Requires: the box is not empty.
double DistanceToRect(const Point& point, const Rect& rect);
double SegmentDistanceToRect(const Point& from, const Point& to, const Rect& rect);

/// `rect` grown by `margin` on each side; shrunk when negative.
Rect Inflate(const Rect& rect, double margin_m);

/// The floor of a world: what is not covered by an obstacle.
///
/// Frames: map, x and y. Cost: linear in the obstacles.
class FreeSpace {
 public:
  FreeSpace() = default;
  explicit FreeSpace(std::vector<Rect> obstacles) : obstacles_(std::move(obstacles)) {}

  void Add(const Rect& obstacle) { obstacles_.push_back(obstacle); }
  const std::vector<Rect>& obstacles() const { return obstacles_; }

  /// Distance to the nearest obstacle; infinite without obstacles.
  double Clearance(const Point& point) const;
  double SegmentClearance(const Point& from, const Point& to) const;
  /// The same as SegmentClearance(from, to) >= radius_m, and faster.
  bool SegmentKeepsClear(const Point& from, const Point& to, double radius_m) const;

 private:
  std::vector<Rect> obstacles_;
};

}  // namespace dsg::simulator
