// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/grid_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

namespace dsg::evaluation {
namespace {

// Lower envelope of parabolas f(q) + (x - q)^2, sampled at whole x.
void TransformLine(const std::vector<double>& f, std::vector<double>* out) {
  const size_t count = f.size();
  std::vector<size_t> roots;
  std::vector<double> begins;
  for (size_t q = 0; q < count; ++q) {
    if (f[q] == kInfinity) continue;
    double begin = -kInfinity;
    while (!roots.empty()) {
      const size_t p = roots.back();
      const auto qd = static_cast<double>(q);
      const auto pd = static_cast<double>(p);
      begin = ((f[q] + qd * qd) - (f[p] + pd * pd)) / (2.0 * (qd - pd));
      if (begin > begins.back()) break;
      roots.pop_back();
      begins.pop_back();
      begin = -kInfinity;
    }
    roots.push_back(q);
    begins.push_back(begin);
  }
  out->assign(count, kInfinity);
  if (roots.empty()) return;
  size_t k = 0;
  for (size_t x = 0; x < count; ++x) {
    while (k + 1 < roots.size() && begins[k + 1] < static_cast<double>(x)) ++k;
    const double step = static_cast<double>(x) - static_cast<double>(roots[k]);
    (*out)[x] = f[roots[k]] + step * step;
  }
}

}  // namespace

std::vector<double> DistanceTransform(const std::vector<uint8_t>& is_set, int width, int height) {
  const auto w = static_cast<size_t>(width);
  const auto h = static_cast<size_t>(height);
  std::vector<double> distance(w * h);
  for (size_t i = 0; i < distance.size(); ++i) distance[i] = is_set[i] != 0 ? 0.0 : kInfinity;
  std::vector<double> line(h);
  std::vector<double> out;
  for (size_t x = 0; x < w; ++x) {
    for (size_t y = 0; y < h; ++y) line[y] = distance[y * w + x];
    TransformLine(line, &out);
    for (size_t y = 0; y < h; ++y) distance[y * w + x] = out[y];
  }
  line.resize(w);
  for (size_t y = 0; y < h; ++y) {
    std::copy_n(distance.begin() + static_cast<std::ptrdiff_t>(y * w), w, line.begin());
    TransformLine(line, &out);
    std::copy(out.begin(), out.end(), distance.begin() + static_cast<std::ptrdiff_t>(y * w));
  }
  for (double& value : distance) value = std::sqrt(value);
  return distance;
}

GridMap::GridMap(const truth::FreeGrid* grid) : grid_(grid) {
  // One ring of obstacles around.
  const int width = grid->width + 2;
  const int height = grid->height + 2;
  std::vector<uint8_t> is_blocked(static_cast<size_t>(width) * static_cast<size_t>(height), 1);
  const auto padded = [width](int x, int y) {
    return static_cast<size_t>(y + 1) * static_cast<size_t>(width) + static_cast<size_t>(x + 1);
  };
  size_t cell = 0;
  for (int y = 0; y < grid->height; ++y) {
    for (int x = 0; x < grid->width; ++x)
      is_blocked[padded(x, y)] = Has(cell++, truth::kCellFree) ? 0 : 1;
  }
  const std::vector<double> distance = DistanceTransform(is_blocked, width, height);
  clearance_m_.reserve(grid->cells.size());
  for (int y = 0; y < grid->height; ++y) {
    for (int x = 0; x < grid->width; ++x) {
      clearance_m_.push_back(distance[padded(x, y)] * grid->cell_m);
    }
  }
}

std::optional<size_t> GridMap::CellAt(const Eigen::Vector2d& point_map) const {
  const Eigen::Vector2d at = (point_map - grid_->origin_map) / grid_->cell_m;
  if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() < grid_->width && at.y() < grid_->height)) {
    return std::nullopt;
  }
  return static_cast<size_t>(at.y()) * static_cast<size_t>(grid_->width) +
         static_cast<size_t>(at.x());
}

Eigen::Vector2d GridMap::CenterOf(size_t cell) const {
  const auto width = static_cast<size_t>(grid_->width);
  return grid_->origin_map +
         grid_->cell_m * Eigen::Vector2d(static_cast<double>(cell % width) + 0.5,
                                         static_cast<double>(cell / width) + 0.5);
}

bool GridMap::IsStraightWay(const Eigen::Vector2d& from_map, const Eigen::Vector2d& to_map,
                            double clearance_m) const {
  const double length = (to_map - from_map).norm();
  const double steps = std::ceil(length / (0.5 * grid_->cell_m)) + 1.0;
  // Far outside the grid: said at once, not after a million steps.
  if (!std::isfinite(length) || !CellAt(from_map).has_value() || !CellAt(to_map).has_value()) {
    return false;
  }
  for (double i = 0.0; i <= steps; i += 1.0) {
    const std::optional<size_t> cell = CellAt(from_map + (i / steps) * (to_map - from_map));
    if (!cell.has_value() || clearance_m_[*cell] < clearance_m || clearance_m_[*cell] == 0.0) {
      return false;
    }
  }
  return true;
}

std::vector<double> GridMap::WaysFrom(size_t start, double clearance_m) const {
  std::vector<double> length(clearance_m_.size(), kInfinity);
  using Entry = std::pair<double, size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const int width = grid_->width;
  const auto is_open = [&](size_t cell) {
    return clearance_m_[cell] > 0.0 && clearance_m_[cell] >= clearance_m;
  };
  if (!is_open(start)) return length;
  length[start] = 0.0;
  open.emplace(0.0, start);
  while (!open.empty()) {
    const auto [so_far, cell] = open.top();
    open.pop();
    if (so_far > length[cell]) continue;
    const int x = static_cast<int>(cell) % width;
    const int y = static_cast<int>(cell) / width;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const bool is_inside =
            x + dx >= 0 && x + dx < width && y + dy >= 0 && y + dy < grid_->height;
        if (!is_inside) continue;
        const auto next =
            static_cast<size_t>(y + dy) * static_cast<size_t>(width) + static_cast<size_t>(x + dx);
        const double step = grid_->cell_m * std::sqrt(static_cast<double>(dx * dx + dy * dy));
        if (!is_open(next) || so_far + step >= length[next]) continue;
        length[next] = so_far + step;
        open.emplace(length[next], next);
      }
    }
  }
  return length;
}

}  // namespace dsg::evaluation
