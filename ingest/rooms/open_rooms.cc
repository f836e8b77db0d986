// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/open_rooms.h"

#include <algorithm>
#include <array>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_point.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/rooms/plan_regions.h"
#include "ingest/rooms/wall_gaps.h"

namespace dsg::ingest {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;

// How finely one looks around a corner; finer finds the same openings.
constexpr int kRayCount = 180;

const std::array<Eigen::Vector3i, 4> kSides = {Eigen::Vector3i(1, 0, 0), Eigen::Vector3i(-1, 0, 0),
                                               Eigen::Vector3i(0, 1, 0), Eigen::Vector3i(0, -1, 0)};

// Of cells by rows: the hull needs the first and last of each only.
class CellShape {
 public:
  explicit CellShape(const GridFrame& frame) : frame_(frame), rows_(frame.size.y()) {}

  void Add(int64_t index) {
    const Eigen::Vector3i cell = frame_.Cell(index);
    Row& row = rows_[static_cast<size_t>(cell.y())];
    row.first = std::min(row.first, cell.x());
    row.last = std::max(row.last, cell.x());
    ++count_;
  }
  int64_t count() const { return count_; }

  // Share of its hull that it fills. Requires: cells.
  double Compactness() const {
    bg::model::multi_point<Point> corners;
    for (size_t y = 0; y < rows_.size(); ++y) {
      if (rows_[y].first > rows_[y].last) continue;
      const double low = static_cast<double>(y);
      for (const double at : {low, low + 1.0}) {
        corners.emplace_back(rows_[y].first, at);
        corners.emplace_back(rows_[y].last + 1, at);
      }
    }
    bg::model::polygon<Point> hull;
    bg::convex_hull(corners, hull);
    return static_cast<double>(count_) / bg::area(hull);
  }

 private:
  struct Row {
    int first = std::numeric_limits<int>::max();
    int last = -1;
  };

  const GridFrame& frame_;
  std::vector<Row> rows_;
  int64_t count_ = 0;
};

class OpenRoomCloser {
 public:
  OpenRoomCloser(const OpenRoomOptions& options, OccupancyGrid* plan)
      : options_(options), plan_(*plan), frame_(plan->frame), seen_(plan->cells.size(), 0) {}

  void Run() {
    FindRegions();
    std::vector<Opening> openings;
    for (const Corner& corner : Corners()) AddOpenings(corner, &openings);
    std::stable_sort(openings.begin(), openings.end(), [](const Opening& a, const Opening& b) {
      return a.gap.WidthM() < b.gap.WidthM();
    });
    // The best first.
    for (const double compact_min : {options_.compact_first, options_.compact_min}) {
      std::vector<Opening> tried;
      for (const Opening& opening : openings) {
        if (!IsWayFree(opening.gap) || IsLikeOneOf(tried, opening)) continue;
        TryToClose(opening, compact_min);
        tried.push_back(opening);
      }
    }
  }

 private:
  /// Regions that are not divided at all, at the ends of walls only, and at all corners.
  enum class Kind { kWhole, kLarge, kSparse };
  struct Corner {
    int64_t cell = 0;
    bool is_wall_end = false;
  };
  struct Opening {
    WallGap gap;
    bool is_at_wall_end = false;
  };

  bool IsFreeCell(const Eigen::Vector3i& cell) const { return plan_.At(cell) == Occupancy::kFree; }
  Eigen::Vector3i CellAt(const Eigen::Vector2d& point) const {
    Eigen::Vector3i cell = frame_.CellOf({point.x(), point.y(), frame_.origin_map.z()});
    cell.z() = 0;
    return cell;
  }
  Eigen::Vector2d CenterOf(int64_t index) const {
    return frame_.Center(frame_.Cell(index)).head<2>();
  }

  // Which regions may be divided, and where they are.
  void FindRegions() {
    std::vector<uint8_t> is_free(plan_.cells.size());
    for (size_t i = 0; i < is_free.size(); ++i) {
      is_free[i] = plan_.cells[i] == Occupancy::kFree ? 1 : 0;
    }
    regions_ = LabelRegions(frame_, is_free, 2.0 * options_.bay_m2_min);
    std::vector<CellShape> shapes(static_cast<size_t>(regions_.count), CellShape(frame_));
    for (size_t i = 0; i < is_free.size(); ++i) {
      const int region = regions_.region_of[i];
      if (region >= 0) shapes[static_cast<size_t>(region)].Add(static_cast<int64_t>(i));
    }
    for (const CellShape& shape : shapes) {
      const bool is_large =
          static_cast<double>(shape.count()) * frame_.cell_m * frame_.cell_m >= options_.large_m2;
      const bool is_sparse = shape.Compactness() < options_.sparse_max;
      kind_of_region_.push_back(is_sparse ? Kind::kSparse : is_large ? Kind::kLarge : Kind::kWhole);
    }
  }

  Kind KindOf(int region) const { return kind_of_region_[static_cast<size_t>(region)]; }

  // -1 = none that may be divided.
  int RegionAt(const Eigen::Vector3i& cell) const {
    if (!frame_.Holds(cell)) return -1;
    const int region = regions_.region_of[static_cast<size_t>(frame_.Index(cell))];
    if (region < 0 || KindOf(region) == Kind::kWhole) return -1;
    return region;
  }

  // Occupied cells around which most is free, the most so of their neighbourhood.
  std::vector<Corner> Corners() const {
    const int reach =
        std::max(1, static_cast<int>(std::lround(options_.corner_reach_m / frame_.cell_m)));
    std::vector<std::pair<double, int64_t>> rated;
    for (int64_t i = 0; i < frame_.CellCount(); ++i) {
      if (plan_.cells[static_cast<size_t>(i)] != Occupancy::kOccupied) continue;
      const Eigen::Vector3i cell = frame_.Cell(i);
      int region = -1;
      for (const Eigen::Vector3i& step : kSides) region = std::max(region, RegionAt(cell + step));
      const double share = region >= 0 ? FreeShare(cell, reach, region) : 0.0;
      if (share >= options_.corner_share_min) rated.emplace_back(-share, i);
    }
    std::sort(rated.begin(), rated.end());
    std::vector<Corner> corners;
    for (const auto& [share, index] : rated) {
      const Eigen::Vector2d at = CenterOf(index);
      const bool is_taken = std::any_of(corners.begin(), corners.end(), [&](const Corner& other) {
        return (CenterOf(other.cell) - at).norm() < options_.corner_apart_m;
      });
      if (!is_taken) corners.push_back({index, -share >= options_.end_share_min});
    }
    return corners;
  }

  // Of one region: what lies behind a closed door is another one's.
  double FreeShare(const Eigen::Vector3i& cell, int reach, int region) const {
    int all = 0, free = 0;
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (dx * dx + dy * dy > reach * reach) continue;
        ++all;
        free += RegionAt(cell + Eigen::Vector3i(dx, dy, 0)) == region ? 1 : 0;
      }
    }
    return static_cast<double>(free) / all;
  }

  // How far a ray goes from a corner until it meets a wall; infinity if it leaves the corner
  // through the wall, ends at what is no wall, or is longer than any opening.
  double RayM(const Eigen::Vector2d& from, const Eigen::Vector2d& way) const {
    constexpr double kNowhere = std::numeric_limits<double>::infinity();
    const double step_m = 0.5 * frame_.cell_m;
    for (double at_m = 1.5 * frame_.cell_m; at_m <= options_.width_m_max; at_m += step_m) {
      const Occupancy state = plan_.At(CellAt(from + at_m * way));
      if (state == Occupancy::kFree) continue;
      return state == Occupancy::kOccupied && at_m >= options_.width_m_min ? at_m : kNowhere;
    }
    return kNowhere;
  }

  void AddOpenings(const Corner& corner, std::vector<Opening>* openings) const {
    const Eigen::Vector2d from = CenterOf(corner.cell);
    std::array<double, kRayCount> length_m;
    std::array<Eigen::Vector2d, kRayCount> ways;
    for (int ray = 0; ray < kRayCount; ++ray) {
      const double angle = 2.0 * std::numbers::pi * ray / kRayCount;
      ways[static_cast<size_t>(ray)] = {std::cos(angle), std::sin(angle)};
      length_m[static_cast<size_t>(ray)] = RayM(from, ways[static_cast<size_t>(ray)]);
    }
    const int rays_beside = static_cast<int>(std::lround(options_.turn_deg / 360.0 * kRayCount));
    for (int ray = 0; ray < kRayCount; ++ray) {
      const double own_m = length_m[static_cast<size_t>(ray)];
      bool is_shortest = std::isfinite(own_m);
      for (int beside = -rays_beside; beside <= rays_beside && is_shortest; ++beside) {
        const auto other = static_cast<size_t>((ray + beside + kRayCount) % kRayCount);
        is_shortest = length_m[other] > own_m || (length_m[other] == own_m && beside >= 0);
      }
      if (!is_shortest) continue;
      const Eigen::Vector3i end = CellAt(from + own_m * ways[static_cast<size_t>(ray)]);
      openings->push_back({{from, frame_.Center(end).head<2>()}, corner.is_wall_end});
    }
  }

  // Corners of one wall end are several, and their openings are the same one.
  bool IsLikeOneOf(const std::vector<Opening>& tried, const Opening& opening) const {
    return std::any_of(tried.begin(), tried.end(), [&](const Opening& other) {
      const auto apart_m = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
        return (from - opening.gap.from_map).norm() + (to - opening.gap.to_map).norm();
      };
      return other.is_at_wall_end == opening.is_at_wall_end &&
             std::min(apart_m(other.gap.from_map, other.gap.to_map),
                      apart_m(other.gap.to_map, other.gap.from_map)) < options_.same_opening_m;
    });
  }

  // No other opening has been closed across it.
  bool IsWayFree(const WallGap& opening) const {
    const Eigen::Vector2d way = (opening.to_map - opening.from_map).normalized();
    const double end_m = opening.WidthM() - 1.5 * frame_.cell_m;
    for (double at_m = 1.5 * frame_.cell_m; at_m < end_m; at_m += 0.5 * frame_.cell_m) {
      if (!IsFreeCell(CellAt(opening.from_map + at_m * way))) return false;
    }
    return true;
  }

  // On the plan itself; taken back if no bay is behind it.
  void TryToClose(const Opening& opening, double compact_min) {
    const Eigen::Vector3i a = CellAt(opening.gap.from_map), b = CellAt(opening.gap.to_map);
    const Eigen::Vector3i low = a.cwiseMin(b), high = a.cwiseMax(b);
    std::vector<std::pair<size_t, Occupancy>> before;
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const auto cell = static_cast<size_t>(frame_.Index({x, y, 0}));
        before.emplace_back(cell, plan_.cells[cell]);
      }
    }
    CloseGap(opening.gap, &plan_);
    const std::optional<Side> smaller = SmallerSide(opening);
    if (smaller.has_value() && IsBay(opening, *smaller, compact_min)) {
      // A room, which is not divided any further.
      for (const int64_t cell : smaller->cells) {
        regions_.region_of[static_cast<size_t>(cell)] = -1;
      }
      return;
    }
    for (const auto& [cell, state] : before) plan_.cells[cell] = state;
  }

  // What lies on one side of a closed opening, as far as it is known.
  struct Side {
    int32_t number = 0;
    Eigen::Vector2d out;
    std::vector<int64_t> cells;
    size_t next = 0;
    double depth_m = 0.0;
    double rim_m = 0.0;

    bool IsWhole() const { return next == cells.size(); }
  };

  // Both sides of the closed opening are flooded in turns, so that the larger one costs no more
  // than the smaller one. None if they are one, both too large, or not to be divided here.
  std::optional<Side> SmallerSide(const Opening& opening) {
    const WallGap& gap = opening.gap;
    std::array<Side, 2> sides;
    for (size_t i = 0; i < 2; ++i) {
      sides[i].number = ++flood_;
      sides[i].out = (i == 0 ? 1.0 : -1.0) * gap.NormalMap();
      const Eigen::Vector3i start = CellAt(gap.MiddleMap() + 3.0 * frame_.cell_m * sides[i].out);
      const int region = RegionAt(start);
      if (region < 0 || !IsFreeCell(start)) return std::nullopt;
      if (KindOf(region) == Kind::kLarge && !opening.is_at_wall_end) return std::nullopt;
      sides[i].cells.push_back(frame_.Index(start));
      seen_[static_cast<size_t>(sides[i].cells[0])] = sides[i].number;
    }
    const auto count_max =
        static_cast<size_t>(options_.bay_m2_max / (frame_.cell_m * frame_.cell_m));
    while (!sides[0].IsWhole() && !sides[1].IsWhole()) {
      if (sides[0].cells.size() > count_max) return std::nullopt;
      for (size_t i = 0; i < 2; ++i) {
        // Around its ends, or through another way: it parts nothing.
        if (!Grow(gap, sides[1 - i].number, &sides[i])) return std::nullopt;
      }
    }
    return std::move(sides[0].IsWhole() ? sides[0] : sides[1]);
  }

  // By the cells beside one cell. False if the other side is reached.
  bool Grow(const WallGap& gap, int32_t other, Side* side) {
    if (side->IsWhole()) return true;
    const int64_t from = side->cells[side->next++];
    side->depth_m = std::max(side->depth_m, side->out.dot(CenterOf(from) - gap.MiddleMap()));
    const Eigen::Vector3i cell = frame_.Cell(from);
    for (const Eigen::Vector3i& step : kSides) {
      const Eigen::Vector3i beside = cell + step;
      if (!IsFreeCell(beside)) {
        side->rim_m += frame_.cell_m;
        continue;
      }
      const int64_t index = frame_.Index(beside);
      int32_t& seen = seen_[static_cast<size_t>(index)];
      if (seen == other) return false;
      if (seen == side->number) continue;
      seen = side->number;
      side->cells.push_back(index);
    }
    return true;
  }

  bool IsBay(const Opening& opening, const Side& side, double compact_min) const {
    const int region = regions_.region_of[static_cast<size_t>(side.cells[0])];
    const double width_m = opening.gap.WidthM();
    if (KindOf(region) == Kind::kLarge && width_m > options_.open_share_max * side.rim_m) {
      return false;
    }
    const double area_m2 = static_cast<double>(side.cells.size()) * frame_.cell_m * frame_.cell_m;
    if (area_m2 < options_.bay_m2_min || side.depth_m < options_.depth_m_min ||
        side.depth_m * side.depth_m > options_.elongation_max * area_m2) {
      return false;
    }
    CellShape shape(frame_);
    for (const int64_t cell : side.cells) shape.Add(cell);
    return shape.Compactness() >= compact_min;
  }

  const OpenRoomOptions& options_;
  OccupancyGrid& plan_;
  const GridFrame& frame_;
  PlanRegions regions_;
  std::vector<Kind> kind_of_region_;
  std::vector<int32_t> seen_;
  int32_t flood_ = 0;
};

}  // namespace

void CloseOpenRooms(const OpenRoomOptions& options, OccupancyGrid* plan) {
  OpenRoomCloser(options, plan).Run();
}

}  // namespace dsg::ingest
