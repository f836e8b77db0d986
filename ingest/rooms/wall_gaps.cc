// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/wall_gaps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::ingest {
namespace {

class GapFinder {
 public:
  GapFinder(const DistanceField& plan, const WallGapOptions& options)
      : plan_(plan), frame_(plan.frame()), options_(options) {}

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
      if (!is_taken && (OpensOnBothSides(gap) || IsMouth(gap))) gaps.push_back(gap);
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

  // A single door may stand in a corner of either room; what is wider has walls at both ends, or
  // bends of corridors would be doors.
  bool OpensOnBothSides(const WallGap& gap) const {
    if (!IsFree(gap.MiddleMap())) return false;
    const bool is_narrow = gap.WidthM() <= options_.narrow_m_max;
    const double depth_m = is_narrow ? options_.narrow_depth_m : options_.wide_depth_m;
    const int jambs = is_narrow ? 1 : 2;
    return OpenJambs(gap, 1.0, depth_m) >= jambs && OpenJambs(gap, -1.0, depth_m) >= jambs;
  }

  // Behind how many jambs the space on one side is wider than the gap.
  int OpenJambs(const WallGap& gap, double side, double depth_m) const {
    const Eigen::Vector2d along = (gap.to_map - gap.from_map).normalized();
    const Eigen::Vector2d out = side * gap.NormalMap();
    const double reach_m = 0.5 * gap.WidthM() + options_.behind_jamb_m;
    int most = 0;
    for (double depth = frame_.cell_m; depth <= depth_m && most < 2; depth += 0.5 * frame_.cell_m) {
      const Eigen::Vector2d middle = gap.MiddleMap() + depth * out;
      if (!IsFree(middle)) break;
      const int open = (IsWayFree(middle, -along, reach_m) ? 1 : 0) +
                       (IsWayFree(middle, along, reach_m) ? 1 : 0);
      most = std::max(most, open);
    }
    return most;
  }

  // Whether a corridor ends here in a hall, which no wall shows.
  bool IsMouth(const WallGap& gap) const {
    if (!IsFree(gap.MiddleMap())) return false;
    for (const double side : {1.0, -1.0}) {
      if (OpenJambs(gap, side, options_.wide_depth_m) > 0 && IsHall(gap, side) &&
          IsArm(gap, -side)) {
        return true;
      }
    }
    return false;
  }

  // Space much wider than the gap is in sight, straight on or aslant.
  bool IsHall(const WallGap& gap, double side) const {
    const double width_m = gap.WidthM();
    const double need_m = options_.hall_widths * width_m;
    for (const double angle : {0.0, 0.25 * std::numbers::pi, -0.25 * std::numbers::pi}) {
      const Eigen::Vector2d way = Eigen::Rotation2Dd(angle) * (side * gap.NormalMap());
      for (double at_m = frame_.cell_m; at_m <= 2.0 * need_m; at_m += frame_.cell_m) {
        const Eigen::Vector2d at = gap.MiddleMap() + at_m * way;
        // A door beside a corridor shows a hall too, but the way there is no wider.
        const double clearance_m = ClearanceM(at);
        const bool is_door = at_m > width_m && clearance_m <= options_.arm_clearance * width_m;
        if (!IsFree(at) || is_door) break;
        if (clearance_m >= need_m) return true;
      }
    }
    return false;
  }

  // The space goes on straight and as narrow as the gap.
  bool IsArm(const WallGap& gap, double side) const {
    const double width_m = gap.WidthM();
    for (double at_m = frame_.cell_m; at_m <= options_.arm_widths * width_m;
         at_m += frame_.cell_m) {
      const Eigen::Vector2d at = gap.MiddleMap() + side * at_m * gap.NormalMap();
      if (!IsFree(at) || ClearanceM(at) > options_.arm_clearance * width_m) return false;
    }
    return true;
  }

  double ClearanceM(const Eigen::Vector2d& point) const {
    const Eigen::Vector3i cell =
        frame_.CellOf({point.x(), point.y(), frame_.origin_map.z() + 0.5 * frame_.cell_m});
    return frame_.Holds(cell) ? static_cast<double>(plan_.DistanceM(frame_.Index(cell))) : 0.0;
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
};

}  // namespace

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
