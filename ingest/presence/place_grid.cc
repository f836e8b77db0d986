// SPDX-License-Identifier: Apache-2.0
#include "ingest/presence/place_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dsg::ingest {
namespace {

// Cells decide what a search costs, not what it finds.
constexpr double kCellSizeMinM = 0.1;

}  // namespace

PlaceGrid::PlaceGrid(std::vector<Item> items) : items_(std::move(items)) {
  if (items_.empty()) return;
  origin_ = corner_ = items_.front().position.head<2>();
  for (const Item& item : items_) {
    origin_ = origin_.cwiseMin(item.position.head<2>());
    corner_ = corner_.cwiseMax(item.position.head<2>());
  }
  // About one item a cell, and never more than about three cells an item, also along a line.
  const Eigen::Vector2d size = corner_ - origin_;
  const auto count = static_cast<double>(items_.size());
  cell_size_m_ =
      std::max({std::sqrt(size.x() * size.y() / count), size.maxCoeff() / count, kCellSizeMinM});
  count_x_ = static_cast<int64_t>(size.x() / cell_size_m_) + 1;
  count_y_ = static_cast<int64_t>(size.y() / cell_size_m_) + 1;
  const auto cell = [this](const Item& item) {
    return CellOf(item.position.y(), origin_.y(), count_y_) * count_x_ +
           CellOf(item.position.x(), origin_.x(), count_x_);
  };
  std::sort(items_.begin(), items_.end(), [&cell](const Item& a, const Item& b) {
    return std::pair(cell(a), a.number) < std::pair(cell(b), b.number);
  });
  cell_begin_.assign(static_cast<size_t>(count_x_ * count_y_) + 1, 0);
  for (const Item& item : items_) ++cell_begin_[static_cast<size_t>(cell(item)) + 1];
  for (size_t i = 1; i < cell_begin_.size(); ++i) cell_begin_[i] += cell_begin_[i - 1];
}

int64_t PlaceGrid::CellOf(double value, double origin, int64_t count) const {
  const double cell = std::floor((value - origin) / cell_size_m_);
  return static_cast<int64_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
}

void PlaceGrid::SearchCell(int64_t x, int64_t y, Search* search) const {
  if (x < 0 || y < 0 || x >= count_x_ || y >= count_y_) return;
  Found& best = search->best;
  const auto cell = static_cast<size_t>(y * count_x_ + x);
  for (uint32_t i = cell_begin_[cell]; i < cell_begin_[cell + 1]; ++i) {
    const double distance = (items_[i].position - search->point).norm();
    const bool is_better = distance < best.distance_m ||
                           (distance == best.distance_m && items_[i].number < best.number);
    if (!is_better || (search->accept && !search->accept(items_[i].number))) continue;
    best = {items_[i].number, distance};
  }
}

void PlaceGrid::SearchRing(int64_t x, int64_t y, int64_t ring, Search* search) const {
  for (int64_t dx = -ring; dx <= ring; ++dx) {
    SearchCell(x + dx, y - ring, search);
    if (ring > 0) SearchCell(x + dx, y + ring, search);
  }
  for (int64_t dy = -ring + 1; dy <= ring - 1; ++dy) {
    SearchCell(x - ring, y + dy, search);
    SearchCell(x + ring, y + dy, search);
  }
}

PlaceGrid::Found PlaceGrid::Nearest(const Eigen::Vector3d& point, const Accept& accept,
                                    double distance_m_max) const {
  constexpr int32_t kNone = std::numeric_limits<int32_t>::max();
  Search search{point, accept, {kNone, distance_m_max}};
  const Found& best = search.best;
  // From outside, the search starts at the point's projection on the grid; the way there adds to
  // every distance (the angle at the projection is never acute).
  const Eigen::Vector2d start = point.head<2>().cwiseMax(origin_).cwiseMin(corner_);
  const double outside_squared = (point.head<2>() - start).squaredNorm();
  const int64_t x = CellOf(start.x(), origin_.x(), count_x_);
  const int64_t y = CellOf(start.y(), origin_.y(), count_y_);
  for (int64_t ring = 0; ring <= std::max(count_x_, count_y_); ++ring) {
    // The start may lie on the border of its cell, so a ring is only ring - 1 cells away.
    const double along = static_cast<double>(std::max<int64_t>(ring - 1, 0)) * cell_size_m_;
    if (outside_squared + along * along > best.distance_m * best.distance_m) break;
    SearchRing(x, y, ring, &search);
  }
  return best.number == kNone ? Found() : best;
}

}  // namespace dsg::ingest
