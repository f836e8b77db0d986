// SPDX-License-Identifier: Apache-2.0
// Exact distances on the floor from points and straight walks to rectangular obstacles.
// Refuses to approximate by grids: what it calls clear is clear.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
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
/// Frames: map, x and y. Cost: the obstacles given at construction are indexed, so that a question
/// costs what is near; those added later are gone through one by one.
class FreeSpace {
 public:
  FreeSpace() = default;
  explicit FreeSpace(std::vector<Rect> obstacles);

  void Add(const Rect& obstacle) { obstacles_.push_back(obstacle); }
  const std::vector<Rect>& obstacles() const { return obstacles_; }

  /// Distance to the nearest obstacle; infinite without obstacles.
  double Clearance(const Point& point) const;
  double SegmentClearance(const Point& from, const Point& to) const;
  /// The same as SegmentClearance(from, to) >= radius_m, and faster.
  bool SegmentKeepsClear(const Point& from, const Point& to, double radius_m) const;

 private:
  /// Columns and rows of tiles, both ends included; empty when it has none.
  struct Tiles {
    int x_min = 0;
    int x_max = -1;
    int y_min = 0;
    int y_max = -1;
  };
  Tiles TilesOf(const Rect& rect) const;
  /// Calls `visit(obstacle)` for each obstacle that comes into `area`, some of them repeatedly,
  /// until it returns false. Returns whether it never did.
  template <typename Visit>
  bool VisitNear(const Rect& area, const Visit& visit) const;

  std::vector<Rect> obstacles_;
  /// A grid of square tiles over the first `indexed_count_` obstacles: those of tile t are
  /// tile_items_[tile_begin_[t]] up to tile_begin_[t + 1].
  size_t indexed_count_ = 0;
  Rect grid_;
  int column_count_ = 0;
  int row_count_ = 0;
  std::vector<int> tile_begin_;
  std::vector<int> tile_items_;
};

}  // namespace dsg::simulator
