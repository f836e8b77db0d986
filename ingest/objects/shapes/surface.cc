// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/model/geometry.h"

namespace dsg::ingest {
namespace {

using Cell = std::array<int64_t, 3>;

Cell CellOf(const Eigen::Vector3d& point, double cell_m) {
  return {static_cast<int64_t>(std::floor(point.x() / cell_m)),
          static_cast<int64_t>(std::floor(point.y() / cell_m)),
          static_cast<int64_t>(std::floor(point.z() / cell_m))};
}

// Cells with the indices of their points, ascending.
std::vector<std::pair<Cell, size_t>> SortByCell(const std::vector<Eigen::Vector3d>& points,
                                                double cell_m) {
  std::vector<std::pair<Cell, size_t>> order(points.size());
  for (size_t i = 0; i < points.size(); ++i) order[i] = {CellOf(points[i], cell_m), i};
  std::sort(order.begin(), order.end());
  return order;
}

// Occupied cells around a surface, and what of the rest is reached from the border.
class OuterSpace {
 public:
  OuterSpace(const std::vector<Eigen::Vector3d>& points, double cell_m) : cell_m_(cell_m) {
    Box3d box;
    for (const Eigen::Vector3d& point : points) box.extend(point);
    // Two cells of margin, so that the outside hangs together.
    min_ = box.min() - Eigen::Vector3d::Constant(2.0 * cell_m);
    for (int axis = 0; axis < 3; ++axis) {
      size_[axis] = static_cast<int64_t>(std::ceil(box.sizes()[axis] / cell_m)) + 4;
    }
    state_.assign(static_cast<size_t>(size_[0] * size_[1] * size_[2]), kUnreached);
    for (const Eigen::Vector3d& point : points) state_[IndexOf(Locate(point))] = kSurface;
    Flood();
  }

  bool IsBeside(const Eigen::Vector3d& point) const {
    const Cell cell = Locate(point);
    for (const Cell& step : kSteps) {
      if (state_[IndexOf(Moved(cell, step))] == kOutside) return true;
    }
    return false;
  }

 private:
  enum State : uint8_t { kUnreached, kSurface, kOutside };
  static constexpr Cell kSteps[6] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                     {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};

  static Cell Moved(const Cell& cell, const Cell& step) {
    return {cell[0] + step[0], cell[1] + step[1], cell[2] + step[2]};
  }
  Cell Locate(const Eigen::Vector3d& point) const { return CellOf(point - min_, cell_m_); }
  size_t IndexOf(const Cell& cell) const {
    return static_cast<size_t>((cell[2] * size_[1] + cell[1]) * size_[0] + cell[0]);
  }
  bool IsInside(const Cell& cell) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (cell[axis] < 0 || cell[axis] >= size_[axis]) return false;
    }
    return true;
  }

  void Flood() {
    std::vector<Cell> open = {{0, 0, 0}};
    state_[0] = kOutside;
    while (!open.empty()) {
      const Cell cell = open.back();
      open.pop_back();
      for (const Cell& step : kSteps) {
        const Cell next = Moved(cell, step);
        if (!IsInside(next) || state_[IndexOf(next)] != kUnreached) continue;
        state_[IndexOf(next)] = kOutside;
        open.push_back(next);
      }
    }
  }

  double cell_m_;
  Eigen::Vector3d min_;
  Cell size_{};
  std::vector<State> state_;
};

}  // namespace

Surface SampleFaces(const CadModel& model, int count) {
  // Areas summed up; sample i stands at the share (i + 0.5) / count of the whole area.
  std::vector<double> sums;
  sums.reserve(model.faces.size());
  double sum = 0.0;
  for (const auto& [a, b, c] : model.faces) {
    const Eigen::Vector3d& corner = model.vertices[a];
    sum += (model.vertices[b] - corner).cross(model.vertices[c] - corner).norm();
    sums.push_back(sum);
  }
  Surface out;
  size_t face = 0;
  for (int i = 0; i < count && sum > 0.0; ++i) {
    const double at = sum * (i + 0.5) / count;
    while (face + 1 < sums.size() && sums[face] < at) ++face;
    const Eigen::Vector3d& a = model.vertices[model.faces[face][0]];
    const Eigen::Vector3d ab = model.vertices[model.faces[face][1]] - a;
    const Eigen::Vector3d ac = model.vertices[model.faces[face][2]] - a;
    // Multiples of the plastic number's powers fill the unit square evenly.
    double u = std::fmod(0.5 + 0.7548776662466927 * (i + 1), 1.0);
    double v = std::fmod(0.5 + 0.5698402909980532 * (i + 1), 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    out.points.emplace_back(a + u * ab + v * ac);
    out.normals.emplace_back(ab.cross(ac).normalized());
  }
  return out;
}

Surface KeepOuter(const Surface& surface, double cell_m) {
  if (surface.points.empty()) return surface;
  const OuterSpace space(surface.points, cell_m);
  Surface out;
  for (size_t i = 0; i < surface.points.size(); ++i) {
    if (!space.IsBeside(surface.points[i])) continue;
    out.points.push_back(surface.points[i]);
    out.normals.push_back(surface.normals[i]);
  }
  return out;
}

Surface ThinSurface(const Surface& surface, double cell_m) {
  const auto order = SortByCell(surface.points, cell_m);
  Surface out;
  for (size_t begin = 0; begin < order.size();) {
    const Cell& cell = order[begin].first;
    const Eigen::Vector3d middle =
        (Eigen::Vector3d(static_cast<double>(cell[0]), static_cast<double>(cell[1]),
                         static_cast<double>(cell[2])) +
         Eigen::Vector3d::Constant(0.5)) *
        cell_m;
    size_t best = order[begin].second;
    size_t end = begin;
    for (; end < order.size() && order[end].first == cell; ++end) {
      const size_t i = order[end].second;
      if ((surface.points[i] - middle).squaredNorm() <
          (surface.points[best] - middle).squaredNorm()) {
        best = i;
      }
    }
    out.points.push_back(surface.points[best]);
    out.normals.push_back(surface.normals[best]);
    begin = end;
  }
  return out;
}

std::vector<Eigen::Vector3d> ThinPoints(const std::vector<Eigen::Vector3d>& points, double cell_m) {
  const auto order = SortByCell(points, cell_m);
  std::vector<Eigen::Vector3d> out;
  for (size_t begin = 0; begin < order.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    size_t end = begin;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      sum += points[order[end].second];
    }
    out.emplace_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
  return out;
}

std::vector<Eigen::Vector3d> EveryNth(const std::vector<Eigen::Vector3d>& points, size_t count) {
  const size_t kept = std::min(count, points.size());
  std::vector<Eigen::Vector3d> out;
  for (size_t i = 0; i < kept; ++i) out.push_back(points[i * points.size() / kept]);
  return out;
}

}  // namespace dsg::ingest
