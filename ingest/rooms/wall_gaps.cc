// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/wall_gaps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

class GapFinder {
 public:
  GapFinder(const DistanceField& plan, const WallGapOptions& options)
      : plan_(plan),
        frame_(plan.frame()),
        options_(options),
        is_block_(FindBlocks(plan.grid(), options)) {}

  std::vector<WallGap> Find() const {
    std::vector<WallGap> candidates = Candidates();
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const WallGap& a, const WallGap& b) { return a.WidthM() < b.WidthM(); });
    std::vector<WallGap> gaps;
    for (const WallGap& gap : candidates) {
      const bool is_taken = std::any_of(gaps.begin(), gaps.end(), [&](const WallGap& other) {
        const double reach_m = std::max(options_.apart_m, 0.5 * other.WidthM());
        return (other.MiddleMap() - gap.MiddleMap()).norm() < reach_m;
      });
      if (!is_taken && OpensOnBothSides(gap)) gaps.push_back(gap);
    }
    return gaps;
  }

 private:
  Eigen::Vector2d CenterOf(int64_t index) const {
    return frame_.Center(frame_.Cell(index)).head<2>();
  }

  bool IsFree(const Eigen::Vector2d& point) const {
    const Eigen::Vector3d at(point.x(), point.y(), frame_.origin_map.z() + 0.5 * frame_.cell_m);
    return plan_.grid().AtPoint(at) == Occupancy::kFree;
  }

  // Pairs of obstacles on opposite sides of neighbouring free cells, each pair once in a row.
  std::vector<WallGap> Candidates() const {
    const int64_t width = frame_.size.x();
    const int64_t count = frame_.CellCount();
    std::vector<WallGap> candidates;
    for (int64_t i = 0; i < count; ++i) {
      if (!IsNear(i)) continue;
      if ((i + 1) % width != 0) AddPair(i, i + 1, &candidates);
      if (i + width < count) AddPair(i, i + width, &candidates);
    }
    return candidates;
  }

  bool IsNear(int64_t i) const {
    return plan_.grid().cells[static_cast<size_t>(i)] == Occupancy::kFree &&
           static_cast<double>(plan_.DistanceM(i)) <= 0.5 * options_.wide_m_max + frame_.cell_m;
  }

  void AddPair(int64_t i, int64_t j, std::vector<WallGap>* candidates) const {
    const int64_t a = plan_.NearestObstacle(i);
    const int64_t b = plan_.NearestObstacle(j);
    if (!IsNear(j) || a < 0 || b < 0 || a == b) return;
    if (is_block_[static_cast<size_t>(a)] != 0 || is_block_[static_cast<size_t>(b)] != 0) return;
    const WallGap gap{CenterOf(std::min(a, b)), CenterOf(std::max(a, b))};
    const double width_m = gap.WidthM();
    const double clearance_m = static_cast<double>(plan_.DistanceM(i));
    // Opposite each other, seen from here.
    if (width_m < options_.opposite * clearance_m || width_m < options_.width_m_min) return;
    if (width_m > options_.wide_m_max) return;
    if (!candidates->empty() && candidates->back().from_map == gap.from_map &&
        candidates->back().to_map == gap.to_map) {
      return;
    }
    candidates->push_back(gap);
  }

  bool OpensOnBothSides(const WallGap& gap) const {
    if (!IsFree(gap.MiddleMap())) return false;
    const bool is_narrow = gap.WidthM() <= options_.narrow_m_max;
    return Opens(gap, 1.0, is_narrow) && Opens(gap, -1.0, is_narrow);
  }

  // Whether the space on one side is wider than the gap.
  bool Opens(const WallGap& gap, double side, bool is_narrow) const {
    const Eigen::Vector2d along = (gap.to_map - gap.from_map).normalized();
    const Eigen::Vector2d out = side * gap.NormalMap();
    const double depth_m = is_narrow ? options_.narrow_depth_m : options_.wide_depth_m;
    const double reach_m = 0.5 * gap.WidthM() + options_.behind_jamb_m;
    for (double depth = frame_.cell_m; depth <= depth_m; depth += 0.5 * frame_.cell_m) {
      const Eigen::Vector2d middle = gap.MiddleMap() + depth * out;
      if (!IsFree(middle)) return false;
      const bool left = IsWayFree(middle, -along, reach_m);
      const bool right = IsWayFree(middle, along, reach_m);
      if (is_narrow ? left || right : left && right) return true;
    }
    return false;
  }

  bool IsWayFree(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                 double length_m) const {
    const int steps = static_cast<int>(std::ceil(length_m / (0.5 * frame_.cell_m)));
    // From the far end: that is where most ways are blocked.
    for (int step = steps; step >= 0; --step) {
      if (!IsFree(from + direction * (length_m * step / steps))) return false;
    }
    return true;
  }

  const DistanceField& plan_;
  const GridFrame& frame_;
  const WallGapOptions& options_;
  const std::vector<uint8_t> is_block_;
};

}  // namespace

std::vector<uint8_t> FindBlocks(const OccupancyGrid& plan, const WallGapOptions& options) {
  const GridFrame& frame = plan.frame;
  std::vector<uint8_t> state(plan.cells.size(), 0);
  std::vector<int64_t> open;
  for (size_t start = 0; start < state.size(); ++start) {
    if (plan.cells[start] != Occupancy::kOccupied || state[start] != 0) continue;
    Eigen::AlignedBox2i box;
    open.assign(1, static_cast<int64_t>(start));
    state[start] = 1;
    for (size_t next = 0; next < open.size(); ++next) {
      const Eigen::Vector3i at = frame.Cell(open[next]);
      box.extend(Eigen::Vector2i(at.head<2>()));
      for (int side = 0; side < 9; ++side) {
        const Eigen::Vector3i cell(at.x() + side % 3 - 1, at.y() + side / 3 - 1, 0);
        if (plan.At(cell) != Occupancy::kOccupied) continue;
        const int64_t index = frame.Index(cell);
        if (state[static_cast<size_t>(index)] != 0) continue;
        state[static_cast<size_t>(index)] = 1;
        open.push_back(index);
      }
    }
    const Eigen::Vector2d size_m = frame.cell_m * (box.sizes().cast<double>().array() + 1).matrix();
    const double filled =
        static_cast<double>(open.size()) * frame.cell_m * frame.cell_m / size_m.prod();
    if (size_m.minCoeff() < options.block_thick_m || size_m.maxCoeff() > options.block_long_m ||
        filled < options.block_filled) {
      continue;
    }
    for (const int64_t cell : open) state[static_cast<size_t>(cell)] = 2;
  }
  for (uint8_t& cell : state) cell = cell == 2 ? 1 : 0;
  return state;
}

std::vector<WallGap> FindWallGaps(const DistanceField& plan, const WallGapOptions& options) {
  return GapFinder(plan, options).Find();
}

void CloseGap(const WallGap& gap, OccupancyGrid* plan) {
  const GridFrame& frame = plan->frame;
  const int steps = static_cast<int>(std::ceil(gap.WidthM() / (0.25 * frame.cell_m)));
  Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);
  for (int step = 0; step <= steps; ++step) {
    const double share = static_cast<double>(step) / std::max(1, steps);
    const Eigen::Vector2d at = gap.from_map + share * (gap.to_map - gap.from_map);
    Eigen::Vector3i cell = frame.CellOf({at.x(), at.y(), frame.origin_map.z()});
    cell.z() = 0;
    const Eigen::Vector3i corner(cell.x(), last.y(), 0);
    if (frame.Holds(cell))
      plan->cells[static_cast<size_t>(frame.Index(cell))] = Occupancy::kOccupied;
    if (last.x() >= 0 && frame.Holds(corner)) {
      plan->cells[static_cast<size_t>(frame.Index(corner))] = Occupancy::kOccupied;
    }
    last = cell;
  }
}

}  // namespace dsg::ingest
