// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/nearby_obstacles.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {

NearbyObstacles::NearbyObstacles(const FreeSpace& free_space, double reach_m) : reach_m_(reach_m) {
  for (const Rect& rect : free_space.obstacles()) bounds_.extend(Inflate(rect, reach_m));
  if (bounds_.isEmpty()) return;
  const Point size = bounds_.sizes();
  columns_ = static_cast<int>(std::floor(size.x() / kCellM)) + 1;
  rows_ = static_cast<int>(std::floor(size.y() / kCellM)) + 1;
  cells_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
  for (const Rect& rect : free_space.obstacles()) {
    const Rect seen = Inflate(rect, reach_m);
    const Eigen::Vector2i low = ((seen.min() - bounds_.min()) / kCellM).cast<int>();
    const Eigen::Vector2i high = ((seen.max() - bounds_.min()) / kCellM).cast<int>();
    for (int row = low.y(); row <= std::min(high.y(), rows_ - 1); ++row) {
      for (int column = low.x(); column <= std::min(high.x(), columns_ - 1); ++column) {
        cells_[static_cast<size_t>(row) * static_cast<size_t>(columns_) +
               static_cast<size_t>(column)]
            .push_back(rect);
      }
    }
  }
}

const std::vector<Rect>& NearbyObstacles::Around(const Point& point) const {
  if (bounds_.isEmpty() || !bounds_.contains(point)) return none_;
  const Eigen::Vector2i cell = ((point - bounds_.min()) / kCellM).cast<int>();
  return cells_[static_cast<size_t>(std::min(cell.y(), rows_ - 1)) * static_cast<size_t>(columns_) +
                static_cast<size_t>(std::min(cell.x(), columns_ - 1))];
}

double NearbyObstacles::Clearance(const Point& point) const {
  double nearest_squared = reach_m_ * reach_m_;
  for (const Rect& rect : Around(point)) {
    nearest_squared = std::min(nearest_squared, rect.squaredExteriorDistance(point));
  }
  return std::sqrt(nearest_squared);
}

Point NearbyObstacles::Push(const Point& point, double distance_m) const {
  Point push = Point::Zero();
  for (const Rect& rect : Around(point)) {
    const Point away = point - point.cwiseMax(rect.min()).cwiseMin(rect.max());
    const double distance = away.norm();
    if (distance < distance_m && distance > 0.0) push += away * (distance_m / distance - 1.0);
  }
  return push;
}

}  // namespace dsg::simulator
