// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/free_space.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace dsg::simulator {
namespace {

constexpr double kTileM = 1.0;

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

FreeSpace::FreeSpace(std::vector<Rect> obstacles) : obstacles_(std::move(obstacles)) {
  indexed_count_ = obstacles_.size();
  if (obstacles_.empty()) return;
  for (const Rect& obstacle : obstacles_) grid_.extend(obstacle);
  column_count_ = 1 + static_cast<int>(grid_.sizes().x() / kTileM);
  row_count_ = 1 + static_cast<int>(grid_.sizes().y() / kTileM);
  std::vector<std::vector<int>> tiles(static_cast<size_t>(column_count_) *
                                      static_cast<size_t>(row_count_));
  for (size_t i = 0; i < obstacles_.size(); ++i) {
    const Tiles range = TilesOf(obstacles_[i]);
    for (int y = range.y_min; y <= range.y_max; ++y) {
      for (int x = range.x_min; x <= range.x_max; ++x) {
        tiles[y * column_count_ + x].push_back(static_cast<int>(i));
      }
    }
  }
  tile_begin_ = {0};
  for (const std::vector<int>& items : tiles) {
    tile_items_.insert(tile_items_.end(), items.begin(), items.end());
    tile_begin_.push_back(static_cast<int>(tile_items_.size()));
  }
}

FreeSpace::Tiles FreeSpace::TilesOf(const Rect& rect) const {
  if (column_count_ == 0 || !rect.intersects(grid_)) return {};
  const Point low = (rect.min() - grid_.min()) / kTileM;
  const Point high = (rect.max() - grid_.min()) / kTileM;
  // Clamped before the conversion: the rectangle may be as large as it likes.
  const auto tile = [](double at, int count) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(count - 1)));
  };
  return {tile(low.x(), column_count_), tile(high.x(), column_count_), tile(low.y(), row_count_),
          tile(high.y(), row_count_)};
}

template <typename Visit>
bool FreeSpace::VisitNear(const Rect& area, const Visit& visit) const {
  for (size_t i = indexed_count_; i < obstacles_.size(); ++i) {
    if (!visit(obstacles_[i])) return false;
  }
  const Tiles range = TilesOf(area);
  for (int y = range.y_min; y <= range.y_max; ++y) {
    for (int x = range.x_min; x <= range.x_max; ++x) {
      const int tile = y * column_count_ + x;
      for (int item = tile_begin_[tile]; item < tile_begin_[tile + 1]; ++item) {
        if (!visit(obstacles_[tile_items_[item]])) return false;
      }
    }
  }
  return true;
}

double FreeSpace::Clearance(const Point& point) const {
  double nearest_squared = std::numeric_limits<double>::infinity();
  if (obstacles_.empty()) return nearest_squared;
  // A square that grows until what it found is nearer than what it left out.
  for (double reach_m = kTileM;; reach_m *= 4.0) {
    const Rect area = Inflate(Rect(point, point), reach_m);
    VisitNear(area, [&](const Rect& obstacle) {
      nearest_squared = std::min(nearest_squared, obstacle.squaredExteriorDistance(point));
      return true;
    });
    if (nearest_squared <= reach_m * reach_m || area.contains(grid_)) break;
  }
  return std::sqrt(nearest_squared);
}

double FreeSpace::SegmentClearance(const Point& from, const Point& to) const {
  double nearest = std::min(Clearance(from), Clearance(to));
  if (obstacles_.empty()) return nearest;
  const Rect area = Inflate(Rect(from.cwiseMin(to), from.cwiseMax(to)), nearest);
  VisitNear(area, [&](const Rect& obstacle) {
    nearest = std::min(nearest, SegmentDistanceToRect(from, to, obstacle));
    return true;
  });
  return nearest;
}

bool FreeSpace::SegmentKeepsClear(const Point& from, const Point& to, double radius_m) const {
  const Rect reach = Inflate(Rect(from.cwiseMin(to), from.cwiseMax(to)), radius_m);
  return VisitNear(reach, [&](const Rect& obstacle) {
    return !reach.intersects(obstacle) || SegmentDistanceToRect(from, to, obstacle) >= radius_m;
  });
}

}  // namespace dsg::simulator
