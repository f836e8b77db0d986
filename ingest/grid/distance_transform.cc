// SPDX-License-Identifier: Apache-2.0
#include "ingest/grid/distance_transform.h"

#include <algorithm>
#include <functional>
#include <thread>

namespace dsg::ingest {
namespace {

constexpr int32_t kFar = ObstacleDistances::kFarSquared;
// Three sides of this length keep the sum of their squares below 2^31.
constexpr int kSideMax = 26'000;

// Splits 0..count into one range per thread; each writes its own cells only.
void InRanges(int64_t count, int thread_count, const std::function<void(int64_t, int64_t)>& work) {
  const int64_t parts = std::clamp<int64_t>(thread_count, 1, std::max<int64_t>(count, 1));
  std::vector<std::thread> threads;
  for (int64_t part = 1; part < parts; ++part) {
    threads.emplace_back(work, part * count / parts, (part + 1) * count / parts);
  }
  work(0, count / parts);
  for (std::thread& thread : threads) thread.join();
}

// Nearest occupied cell of the own row: one sweep up, one down. The upper one must be strictly
// nearer, so that ties go to the lower index.
void SweepRow(const OccupancyGrid& grid, int64_t begin, ObstacleDistances* out) {
  const int64_t end = begin + grid.frame.size.x();
  int64_t last = -1;
  for (int64_t i = begin; i < end; ++i) {
    if (grid.cells[i] == Occupancy::kOccupied) last = i;
    out->nearest[i] = static_cast<int32_t>(last);
    out->squared_cells[i] = last < 0 ? kFar : static_cast<int32_t>((i - last) * (i - last));
  }
  last = -1;
  for (int64_t i = end - 1; i >= begin; --i) {
    if (grid.cells[i] == Occupancy::kOccupied) last = i;
    if (last < 0) continue;
    const auto squared = static_cast<int32_t>((last - i) * (last - i));
    if (squared >= out->squared_cells[i]) continue;
    out->squared_cells[i] = squared;
    out->nearest[i] = static_cast<int32_t>(last);
  }
}

int64_t FloorDivide(int64_t a, int64_t b) { return a / b - ((a % b != 0) && (a < 0) ? 1 : 0); }

// Lower envelope of the parabolas f(q) + (x - q)^2 along one line of cells, at whole x only.
class LineTransform {
 public:
  explicit LineTransform(int64_t count) : count_(count), roots_(count) {}

  void Run(int64_t begin, int64_t stride, ObstacleDistances* out) {
    root_count_ = 0;
    for (int64_t q = 0; q < count_; ++q) {
      const int32_t squared = out->squared_cells[begin + q * stride];
      if (squared != kFar) Push({q, squared, out->nearest[begin + q * stride], 0});
    }
    if (root_count_ == 0) return;
    int64_t k = 0;
    for (int64_t x = 0; x < count_; ++x) {
      while (k + 1 < root_count_ && roots_[k + 1].from <= x) ++k;
      const Root& root = roots_[k];
      const int64_t step = x - root.at;
      out->squared_cells[begin + x * stride] = static_cast<int32_t>(root.squared + step * step);
      out->nearest[begin + x * stride] = root.nearest;
    }
  }

 private:
  struct Root {
    int64_t at = 0;
    int64_t squared = 0;
    int32_t nearest = kNoObstacle;
    // First x at which it is strictly below all roots before it.
    int64_t from = 0;
  };

  void Push(Root root) {
    while (root_count_ > 0) {
      const Root& top = roots_[root_count_ - 1];
      const int64_t rise = root.squared + root.at * root.at - top.squared - top.at * top.at;
      root.from = FloorDivide(rise, 2 * (root.at - top.at)) + 1;
      if (root.from > top.from) break;
      --root_count_;
    }
    if (root_count_ == 0) root.from = 0;
    if (root.from < count_) roots_[root_count_++] = root;
  }

  int64_t count_;
  int64_t root_count_ = 0;
  std::vector<Root> roots_;
};

}  // namespace

bool CanMeasure(const GridFrame& frame) {
  const bool has_sides = (frame.size.array() >= 0).all() && (frame.size.array() <= kSideMax).all();
  return has_sides && frame.CellCount() < INT32_MAX;
}

ObstacleDistances MeasureObstacles(const OccupancyGrid& grid, int thread_count) {
  const Eigen::Vector3i& size = grid.frame.size;
  ObstacleDistances out;
  out.squared_cells.resize(grid.frame.CellCount());
  out.nearest.resize(grid.frame.CellCount());
  const int64_t row_count = int64_t{size.y()} * size.z();
  const int64_t layer = int64_t{size.x()} * size.y();
  InRanges(row_count, thread_count, [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) SweepRow(grid, row * size.x(), &out);
  });
  if (size.y() > 1) {
    InRanges(size.z() * int64_t{size.x()}, thread_count, [&](int64_t begin, int64_t end) {
      LineTransform line(size.y());
      for (int64_t i = begin; i < end; ++i) {
        line.Run(i / size.x() * layer + i % size.x(), size.x(), &out);
      }
    });
  }
  if (size.z() > 1) {
    InRanges(layer, thread_count, [&](int64_t begin, int64_t end) {
      LineTransform line(size.z());
      for (int64_t i = begin; i < end; ++i) line.Run(i, layer, &out);
    });
  }
  return out;
}

}  // namespace dsg::ingest
