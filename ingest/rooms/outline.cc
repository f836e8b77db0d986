// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/outline.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

struct Corner {
  int x = 0;
  int y = 0;
  bool operator==(const Corner&) const = default;
};

/// Cells of one region in their bounding box, with an empty border around.
class Mask {
 public:
  Mask(int width, int height)
      : width_(width + 2),
        height_(height + 2),
        cells_(static_cast<size_t>(width_) * static_cast<size_t>(height_), 0) {}

  /// From -1 to the size, both included.
  uint8_t& At(int x, int y) {
    return cells_[static_cast<size_t>(y + 1) * static_cast<size_t>(width_) +
                  static_cast<size_t>(x + 1)];
  }
  int width() const { return width_ - 2; }
  int height() const { return height_ - 2; }

  /// Cells that touch at a corner only would make the outline touch itself there.
  void JoinCorners() {
    for (bool changed = true; changed;) {
      changed = false;
      for (int y = 0; y + 1 < height(); ++y) {
        for (int x = 0; x + 1 < width(); ++x) changed |= JoinCorner(x, y);
      }
    }
  }

  /// Gives all cells that the outside does not reach to the region, and leaves only its largest
  /// part.
  void KeepLargestFilled() {
    std::vector<Corner> best;
    for (int y = 0; y < height(); ++y) {
      for (int x = 0; x < width(); ++x) {
        std::vector<Corner> part = Flood(x, y, 1, 2);
        if (part.size() > best.size()) best.swap(part);
      }
    }
    std::fill(cells_.begin(), cells_.end(), uint8_t{0});
    for (const Corner& cell : best) At(cell.x, cell.y) = 1;
    Flood(-1, -1, 0, 3);
    for (uint8_t& cell : cells_) cell = cell == 3 ? 0 : 1;
  }

 private:
  bool JoinCorner(int x, int y) {
    uint8_t& a = At(x, y);
    uint8_t& b = At(x + 1, y);
    uint8_t& c = At(x, y + 1);
    uint8_t& d = At(x + 1, y + 1);
    if (a != d || b != c || a == b) return false;
    a = b = c = d = 1;
    return true;
  }

  std::vector<Corner> Flood(int x, int y, uint8_t from, uint8_t to) {
    std::vector<Corner> cells;
    const auto visit = [&](int at_x, int at_y) {
      if (at_x < -1 || at_y < -1 || at_x > width() || at_y > height()) return;
      uint8_t& cell = At(at_x, at_y);
      if (cell != from) return;
      cell = to;
      cells.push_back({at_x, at_y});
    };
    visit(x, y);
    for (size_t i = 0; i < cells.size(); ++i) {
      const Corner at = cells[i];
      visit(at.x + 1, at.y);
      visit(at.x - 1, at.y);
      visit(at.x, at.y + 1);
      visit(at.x, at.y - 1);
    }
    return cells;
  }

  int width_;
  int height_;
  std::vector<uint8_t> cells_;
};

// Corners of the cells' edges with the cells to the left, one for each turn.
std::vector<Corner> Trace(Mask* mask) {
  Corner start;
  while (mask->At(start.x, start.y) == 0) {
    if (++start.x == mask->width()) start = {0, start.y + 1};
  }
  // Along the lower edge of the lowest cell, eastwards.
  constexpr int kStep[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  // The cell to the left of a step from a corner.
  constexpr int kLeft[4][2] = {{0, 0}, {-1, 0}, {-1, -1}, {0, -1}};
  std::vector<Corner> corners;
  Corner at = start;
  int heading = 0;
  do {
    corners.push_back(at);
    const auto is_in = [&](int direction) {
      return mask->At(at.x + kLeft[direction][0], at.y + kLeft[direction][1]) != 0;
    };
    while (is_in(heading) && !is_in((heading + 3) % 4)) {
      at = {at.x + kStep[heading][0], at.y + kStep[heading][1]};
      if (at == start) break;
    }
    heading = is_in(heading) ? (heading + 3) % 4 : (heading + 1) % 4;
  } while (!(at == start));
  return corners;
}

double DistanceToLine(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                      const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  const double share =
      length2 > 0.0 ? std::clamp((point - from).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (point - from - share * along).norm();
}

// Marks what Douglas and Peucker keep between two corners.
void Simplify(const Polygon2d& polygon, size_t first, size_t last, double tolerance,
              std::vector<bool>* is_kept) {
  std::vector<std::pair<size_t, size_t>> open = {{first, last}};
  while (!open.empty()) {
    const auto [from, to] = open.back();
    open.pop_back();
    double worst = tolerance;
    size_t split = from;
    for (size_t i = from + 1; i < to; ++i) {
      const double off = DistanceToLine(polygon[i], polygon[from], polygon[to % polygon.size()]);
      if (off > worst) {
        worst = off;
        split = i;
      }
    }
    if (split == from) continue;
    (*is_kept)[split] = true;
    open.push_back({from, split});
    open.push_back({split, to});
  }
}

bool Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
           const Eigen::Vector2d& d) {
  const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& r) {
    return (q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x());
  };
  return side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0;
}

bool IsSimple(const Polygon2d& polygon) {
  const size_t count = polygon.size();
  if (count < 3) return false;
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = i + 2; j < count; ++j) {
      if (i == 0 && j == count - 1) continue;
      if (Cross(polygon[i], polygon[i + 1], polygon[j], polygon[(j + 1) % count])) return false;
    }
  }
  return true;
}

Polygon2d Simplified(const Polygon2d& polygon, double tolerance) {
  // The corner farthest from the first one is sure to be one of the outline's.
  size_t far = 0;
  for (size_t i = 1; i < polygon.size(); ++i) {
    if ((polygon[i] - polygon[0]).norm() > (polygon[far] - polygon[0]).norm()) far = i;
  }
  std::vector<bool> is_kept(polygon.size(), false);
  is_kept[0] = is_kept[far] = true;
  Simplify(polygon, 0, far, tolerance, &is_kept);
  Simplify(polygon, far, polygon.size(), tolerance, &is_kept);
  Polygon2d simple;
  for (size_t i = 0; i < polygon.size(); ++i) {
    if (is_kept[i]) simple.push_back(polygon[i]);
  }
  return simple;
}

Polygon2d OutlineOf(Mask* mask, const Corner& low, const GridFrame& frame) {
  mask->JoinCorners();
  mask->KeepLargestFilled();
  mask->JoinCorners();
  Polygon2d exact;
  for (const Corner& corner : Trace(mask)) {
    exact.push_back(frame.origin_map.head<2>() +
                    frame.cell_m * Eigen::Vector2d(low.x + corner.x, low.y + corner.y));
  }
  for (const double tolerance : {1.05, 0.5}) {
    Polygon2d simple = Simplified(exact, tolerance * frame.cell_m);
    if (IsSimple(simple)) return simple;
  }
  return exact;
}

}  // namespace

double MainAngle(const std::vector<Polygon2d>& outlines, double tolerance_m) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Polygon2d& exact : outlines) {
    const bool is_rough = tolerance_m > 0.0 && exact.size() > 3;
    const Polygon2d outline = is_rough ? Simplified(exact, tolerance_m) : exact;
    for (size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d edge = outline[(i + 1) % outline.size()] - outline[i];
      const double angle = 4.0 * std::atan2(edge.y(), edge.x());
      sum += edge.squaredNorm() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
  }
  return 0.25 * std::atan2(sum.y(), sum.x());
}

std::vector<Polygon2d> OutlinesOf(const PlanRegions& regions) {
  const int width = regions.frame.size.x();
  struct Bounds {
    Corner low = {1 << 30, 1 << 30};
    Corner high = {-1, -1};
  };
  std::vector<Bounds> bounds(static_cast<size_t>(regions.count));
  std::vector<std::vector<Corner>> cells(bounds.size());
  for (size_t i = 0; i < regions.region_of.size(); ++i) {
    if (regions.region_of[i] < 0) continue;
    const auto region = static_cast<size_t>(regions.region_of[i]);
    const Corner cell = {static_cast<int>(i) % width, static_cast<int>(i) / width};
    Bounds& box = bounds[region];
    box.low = {std::min(box.low.x, cell.x), std::min(box.low.y, cell.y)};
    box.high = {std::max(box.high.x, cell.x), std::max(box.high.y, cell.y)};
    cells[region].push_back(cell);
  }
  std::vector<Polygon2d> outlines(bounds.size());
  for (size_t region = 0; region < bounds.size(); ++region) {
    if (cells[region].empty()) continue;
    const auto& [low, high] = bounds[region];
    Mask mask(high.x - low.x + 1, high.y - low.y + 1);
    for (const Corner& cell : cells[region]) mask.At(cell.x - low.x, cell.y - low.y) = 1;
    outlines[region] = OutlineOf(&mask, low, regions.frame);
  }
  return outlines;
}

}  // namespace dsg::ingest
