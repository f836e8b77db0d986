// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/room_shell.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "ingest/objects/height_squares.h"

namespace dsg::ingest {
namespace {

// Heights of floors are counted in bins, and what stands upright in columns.
constexpr double kLevelBinM = 0.05;
constexpr double kColumnM = 0.1;
constexpr size_t kColumnBins = 64;

struct UprightRegion {
  std::vector<int> cells;
  Eigen::Vector3d normal_sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d point_sum = Eigen::Vector3d::Zero();
  /// WallOf the region, of joined ones.
  ShellWall wall;

  Eigen::Vector3d Normal() const {
    return Eigen::Vector3d(normal_sum.x(), normal_sum.y(), 0.0).normalized();
  }
  double Offset() const { return -Normal().dot(point_sum) / static_cast<double>(cells.size()); }
};

class ShellFinder {
 public:
  ShellFinder(const CellGraph& graph, const SegmentOptions& options)
      : graph_(graph),
        options_(options),
        level_normal_(static_cast<float>(options.shell.level_normal)) {
    shell_.parts.assign(graph.size(), ShellPart::kNone);
    shell_.heights_m.assign(graph.size(), 0.0f);
    shell_.depths_m.assign(graph.size(), INFINITY);
  }

  RoomShell Find(const std::vector<double>& floors_m) && {
    if (graph_.size() == 0) return std::move(shell_);
    shell_.floors_m = floors_m.empty() ? FindLevels() : floors_m;
    std::sort(shell_.floors_m.begin(), shell_.floors_m.end());
    GrowFloors();
    MarkFloors();
    MarkCeilings();
    MarkWalls();
    return std::move(shell_);
  }

 private:
  Eigen::Vector3d Point(int cell) const {
    return graph_.points_map[static_cast<size_t>(cell)].cast<double>();
  }
  const Eigen::Vector3f& Normal(int cell) const {
    return graph_.normals_map[static_cast<size_t>(cell)];
  }
  ShellPart& Part(int cell) { return shell_.parts[static_cast<size_t>(cell)]; }
  bool LooksUp(int cell) const {
    const float z = Normal(cell).z();
    return z >= level_normal_ || (!graph_.is_oriented && z <= -level_normal_);
  }
  bool LooksDown(int cell) const {
    const float z = Normal(cell).z();
    return z <= -level_normal_ || (!graph_.is_oriented && z >= level_normal_);
  }
  bool IsFree(int cell) const {
    return shell_.parts[static_cast<size_t>(cell)] == ShellPart::kNone;
  }
  int count() const { return static_cast<int>(graph_.size()); }
  double CellArea() const { return graph_.cell_m * graph_.cell_m; }

  // The lowest large level surface, and those a storey higher.
  std::vector<double> FindLevels() const {
    std::map<int, MeanHeight> bins;
    for (int i = 0; i < count(); ++i) {
      if (!LooksUp(i)) continue;
      MeanHeight& bin = bins[static_cast<int>(std::floor(Point(i).z() / kLevelBinM))];
      bin.sum_m += Point(i).z();
      ++bin.count;
    }
    std::vector<double> levels;
    double largest_m2 = 0.0;
    for (const auto& [index, bin] : bins) {
      // The bin with its neighbours, where it is the fullest of them.
      MeanHeight sum;
      bool is_peak = true;
      for (int other = index - 1; other <= index + 1; ++other) {
        const auto found = bins.find(other);
        if (found == bins.end()) continue;
        sum.sum_m += found->second.sum_m;
        sum.count += found->second.count;
        is_peak &= found->second.count <= bin.count;
      }
      const double area_m2 = sum.count * CellArea();
      if (!is_peak || area_m2 < options_.floor_area_m2) continue;
      if (!levels.empty()) {
        if (sum.Mean() - levels.back() < options_.shell.storey_m) continue;
        if (area_m2 < options_.shell.upper_floor_share * largest_m2) continue;
      }
      levels.push_back(sum.Mean());
      largest_m2 = std::max(largest_m2, area_m2);
    }
    return levels;
  }

  // Cells that look up, from those at the level on, as far as they go on without a step.
  void GrowFloors() {
    floor_maps_.resize(shell_.floors_m.size());
    for (size_t level = 0; level < shell_.floors_m.size(); ++level) {
      const double level_m = shell_.floors_m[level];
      std::vector<int> open;
      for (int i = 0; i < count(); ++i) {
        if (Part(i) != ShellPart::kNone || !LooksUp(i)) continue;
        if (std::abs(Point(i).z() - level_m) > options_.floor_skin_m) continue;
        Part(i) = ShellPart::kFloor;
        open.push_back(i);
      }
      for (size_t next = 0; next < open.size(); ++next) {
        const double z_m = Point(open[next]).z();
        AddHeight(Point(open[next]), &floor_maps_[level]);
        for (const int other : graph_.NeighboursOf(open[next])) {
          if (Part(other) != ShellPart::kNone || !LooksUp(other)) continue;
          if (std::abs(Point(other).z() - z_m) > 0.5 * graph_.cell_m) continue;
          if (std::abs(Point(other).z() - level_m) > options_.floor_drift_m) continue;
          Part(other) = ShellPart::kFloor;
          open.push_back(other);
        }
      }
    }
  }

  // All that is near the floor, and what seems to be below it.
  void MarkFloors() {
    double lowest_m = INFINITY;
    for (int i = 0; i < count(); ++i) lowest_m = std::min(lowest_m, Point(i).z());
    for (int i = 0; i < count(); ++i) {
      const Eigen::Vector3d point = Point(i);
      const auto above = std::upper_bound(shell_.floors_m.begin(), shell_.floors_m.end(),
                                          point.z() + options_.floor_drift_m);
      if (above == shell_.floors_m.begin()) {
        if (!shell_.floors_m.empty()) Part(i) = ShellPart::kFloor;
        shell_.heights_m[static_cast<size_t>(i)] = static_cast<float>(point.z() - lowest_m);
        continue;
      }
      const auto level = static_cast<size_t>(above - shell_.floors_m.begin() - 1);
      const double floor_m = HeightAt(floor_maps_[level], point, options_.shell.floor_squares)
                                 .value_or(shell_.floors_m[level]);
      const double height_m = point.z() - floor_m;
      shell_.heights_m[static_cast<size_t>(i)] = static_cast<float>(height_m);
      if (height_m <= options_.floor_skin_m) Part(i) = ShellPart::kFloor;
    }
  }

  // Large level surfaces that look down, high above the floor, and what is above them.
  void MarkCeilings() {
    std::vector<bool> is_seen(graph_.size(), false);
    const auto may_be = [&](int i) {
      return Part(i) == ShellPart::kNone && !is_seen[static_cast<size_t>(i)] && LooksDown(i) &&
             shell_.heights_m[static_cast<size_t>(i)] >= options_.ceiling_height_m;
    };
    for (int seed = 0; seed < count(); ++seed) {
      if (!may_be(seed)) continue;
      std::vector<int> open = {seed};
      is_seen[static_cast<size_t>(seed)] = true;
      for (size_t next = 0; next < open.size(); ++next) {
        for (const int other : graph_.NeighboursOf(open[next])) {
          if (!may_be(other)) continue;
          is_seen[static_cast<size_t>(other)] = true;
          open.push_back(other);
        }
      }
      if (static_cast<double>(open.size()) * CellArea() < options_.ceiling_area_m2) continue;
      for (const int cell : open) AddHeight(Point(cell), &ceiling_map_);
    }
    if (ceiling_map_.empty()) return;
    const double usual_m = UsualCeilingHeight();
    for (int i = 0; i < count(); ++i) {
      const double floor_m =
          Point(i).z() - static_cast<double>(shell_.heights_m[static_cast<size_t>(i)]);
      const double below_m = HeightAt(ceiling_map_, Point(i), options_.shell.ceiling_squares)
                                 .value_or(floor_m + usual_m) -
                             Point(i).z();
      if (below_m < -options_.shell.slab_m) continue;  // Another storey.
      shell_.depths_m[static_cast<size_t>(i)] = static_cast<float>(below_m);
      if (Part(i) == ShellPart::kNone && below_m <= options_.ceiling_skin_m) {
        Part(i) = ShellPart::kCeiling;
      }
    }
  }

  // Above the floor, where most of the ceiling is.
  double UsualCeilingHeight() const {
    std::vector<float> heights;
    for (int i = 0; i < count(); ++i) {
      const float height_m = shell_.heights_m[static_cast<size_t>(i)];
      if (LooksDown(i) && height_m >= static_cast<float>(options_.ceiling_height_m)) {
        heights.push_back(height_m);
      }
    }
    const auto middle = heights.begin() + static_cast<int64_t>(heights.size() / 2);
    std::nth_element(heights.begin(), middle, heights.end());
    return static_cast<double>(*middle);
  }

  bool IsUpright(int cell) const {
    const Eigen::Vector3f& normal = Normal(cell);
    return std::abs(normal.z()) <= static_cast<float>(options_.shell.upright_normal) &&
           !normal.isZero();
  }

  // Whether all around a cell looks the same way: regions begin there.
  bool IsEven(int cell) const {
    const std::span<const int> around = graph_.NeighboursOf(cell);
    return around.size() >= 4 && std::all_of(around.begin(), around.end(), [&](int other) {
             return graph_.CosineOf(cell, other) >= options_.shell.grow_cosine;
           });
  }

  UprightRegion GrowRegion(int seed, std::vector<bool>* is_taken) const {
    UprightRegion region;
    const auto take = [&](int cell) {
      (*is_taken)[static_cast<size_t>(cell)] = true;
      region.cells.push_back(cell);
      region.normal_sum += graph_.NormalAs(region.normal_sum, cell);
      region.point_sum += Point(cell);
    };
    take(seed);
    for (size_t next = 0; next < region.cells.size(); ++next) {
      const Eigen::Vector3d normal = region.Normal();
      const double offset_m = region.Offset();
      for (const int other : graph_.NeighboursOf(region.cells[next])) {
        if ((*is_taken)[static_cast<size_t>(other)] || !IsUpright(other)) continue;
        if (graph_.Cosine(Normal(other).cast<double>(), normal) < options_.shell.grow_cosine)
          continue;
        if (std::abs(normal.dot(Point(other)) + offset_m) > options_.shell.off_face_m) continue;
        take(other);
      }
    }
    return region;
  }

  ShellWall WallOf(const UprightRegion& region) const {
    ShellWall wall;
    wall.normal_map = region.Normal();
    wall.offset_m = region.Offset();
    wall.begin_m = wall.low_m = INFINITY;
    wall.end_m = wall.top_m = -INFINITY;
    const Eigen::Vector3d along = wall.Along();
    for (const int cell : region.cells) {
      const double along_m = along.dot(Point(cell));
      wall.begin_m = std::min(wall.begin_m, along_m);
      wall.end_m = std::max(wall.end_m, along_m);
      wall.low_m = std::min(wall.low_m, Point(cell).z());
      wall.top_m = std::max(wall.top_m, Point(cell).z());
    }
    wall.area_m2 = static_cast<double>(region.cells.size()) * CellArea();
    return wall;
  }

  // The room is where most of the surface is.
  void TurnToRoom(ShellWall* wall) const {
    int64_t balance = 0;
    for (int i = 0; i < count(); ++i) {
      const double distance_m = wall->DistanceTo(Point(i));
      if (std::abs(distance_m) > options_.shell.room_m || !wall->IsBeside(Point(i), 0.0)) continue;
      balance += distance_m > 0.0 ? 1 : -1;
    }
    if (balance >= 0) return;
    wall->normal_map = -wall->normal_map;
    wall->offset_m = -wall->offset_m;
    std::swap(wall->begin_m, wall->end_m);
    wall->begin_m = -wall->begin_m;
    wall->end_m = -wall->end_m;
  }

  bool MayJoin(const UprightRegion& a, const UprightRegion& b) const {
    if (graph_.Cosine(a.Normal(), b.Normal()) < options_.shell.join_cosine) return false;
    const ShellWall& wall = a.wall;
    const Eigen::Vector3d middle = b.point_sum / static_cast<double>(b.cells.size());
    if (std::abs(wall.DistanceTo(middle)) > options_.shell.off_joined_m) return false;
    const Eigen::Vector3d along = wall.Along();
    double begin_m = INFINITY;
    double end_m = -INFINITY;
    for (const int cell : b.cells) {
      begin_m = std::min(begin_m, along.dot(Point(cell)));
      end_m = std::max(end_m, along.dot(Point(cell)));
    }
    return begin_m <= wall.end_m + options_.wall_gap_m &&
           end_m >= wall.begin_m - options_.wall_gap_m;
  }

  // The largest takes what lies in its plane beside it.
  std::vector<UprightRegion> FindRegions() const {
    std::vector<bool> is_taken(graph_.size(), false);
    std::vector<UprightRegion> regions;
    for (int seed = 0; seed < count(); ++seed) {
      if (is_taken[static_cast<size_t>(seed)] || !IsUpright(seed) || !IsEven(seed)) continue;
      UprightRegion region = GrowRegion(seed, &is_taken);
      if (static_cast<double>(region.cells.size()) * CellArea() < options_.shell.face_m2_min)
        continue;
      regions.push_back(std::move(region));
    }
    std::stable_sort(regions.begin(), regions.end(),
                     [](const auto& a, const auto& b) { return a.cells.size() > b.cells.size(); });
    std::vector<UprightRegion> joined;
    for (UprightRegion& region : regions) {
      const auto host = std::find_if(joined.begin(), joined.end(), [&](const UprightRegion& other) {
        return MayJoin(other, region);
      });
      if (host == joined.end()) {
        joined.push_back(std::move(region));
        joined.back().wall = WallOf(joined.back());
        continue;
      }
      host->cells.insert(host->cells.end(), region.cells.begin(), region.cells.end());
      const bool is_turned = host->normal_sum.dot(region.normal_sum) < 0.0;
      host->normal_sum += is_turned ? Eigen::Vector3d(-region.normal_sum) : region.normal_sum;
      host->point_sum += region.point_sum;
      host->wall = WallOf(*host);
    }
    return joined;
  }

  // By cell: how many cells the region that it is in has.
  std::vector<size_t> RegionSizes(const std::vector<UprightRegion>& regions) const {
    std::vector<size_t> sizes(graph_.size(), 0);
    for (const UprightRegion& region : regions) {
      for (const int cell : region.cells) sizes[static_cast<size_t>(cell)] = region.cells.size();
    }
    return sizes;
  }

  // Whether a larger face that looks the same way stands behind much of a region, or behind the
  // line that it makes, right beside it: then it is the front of a cupboard.
  bool IsFront(const UprightRegion& region, const ShellWall& wall,
               const std::vector<size_t>& region_sizes) const {
    const Eigen::Vector3d along = wall.Along();
    const auto column_of = [&](int cell) {
      return static_cast<int>(std::floor(along.dot(Point(cell)) / kColumnM));
    };
    std::set<int> columns;
    for (const int cell : region.cells) columns.insert(column_of(cell));
    const int first = *columns.begin();
    const int last = *columns.rbegin();
    const int beside = options_.shell.beside_columns;
    std::set<int> backed;
    std::set<int> before;
    std::set<int> after;
    for (int i = 0; i < count(); ++i) {
      if (region_sizes[static_cast<size_t>(i)] <= region.cells.size() || !IsFree(i)) continue;
      const double distance_m = wall.DistanceTo(Point(i));
      if (distance_m > -options_.shell.behind_m || distance_m < -options_.front_depth_m) continue;
      if (graph_.Cosine(Normal(i).cast<double>(), wall.normal_map) < options_.shell.grow_cosine)
        continue;
      const int column = column_of(i);
      if (columns.contains(column)) backed.insert(column);
      if (column < first && column >= first - beside) before.insert(column);
      if (column > last && column <= last + beside) after.insert(column);
    }
    if (static_cast<double>(backed.size()) >=
        options_.front_share * static_cast<double>(columns.size())) {
      return true;
    }
    if (wall.end_m - wall.begin_m > options_.front_width_m) return false;
    return 2 * std::max(before.size(), after.size()) >= static_cast<size_t>(beside);
  }

  // Near the ceiling, where there is one; else above `top_min_m`.
  bool ReachesUp(const UprightRegion& region, double top_min_m) const {
    float top_m = 0.0f;
    float depth_m = INFINITY;
    for (const int cell : region.cells) {
      top_m = std::max(top_m, shell_.heights_m[static_cast<size_t>(cell)]);
      depth_m = std::min(depth_m, shell_.depths_m[static_cast<size_t>(cell)]);
    }
    if (std::isfinite(depth_m)) return static_cast<double>(depth_m) <= options_.wall_top_gap_m;
    return static_cast<double>(top_m) >= top_min_m;
  }

  // What is solid from the floor to the ceiling: walls too rough for a plane, pillars, frames.
  void MarkColumns() {
    std::map<std::pair<int, int>, std::bitset<kColumnBins>> columns;
    const auto column_of = [&](int cell) {
      return std::pair(static_cast<int>(std::floor(Point(cell).x() / kColumnM)),
                       static_cast<int>(std::floor(Point(cell).y() / kColumnM)));
    };
    const auto bin_of = [&](int cell) {
      return static_cast<int>(shell_.heights_m[static_cast<size_t>(cell)] /
                              static_cast<float>(kColumnM));
    };
    for (int i = 0; i < count(); ++i) {
      // What stands before a flat wall is not filled by it.
      if (Part(i) == ShellPart::kWall) continue;
      if (!std::isfinite(shell_.depths_m[static_cast<size_t>(i)]) || bin_of(i) < 0) continue;
      if (bin_of(i) < static_cast<int>(kColumnBins)) {
        columns[column_of(i)].set(static_cast<size_t>(bin_of(i)));
      }
    }
    for (int i = 0; i < count(); ++i) {
      if (!IsFree(i) || !std::isfinite(shell_.depths_m[static_cast<size_t>(i)])) continue;
      const auto [x, y] = column_of(i);
      std::bitset<kColumnBins> around;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          const auto found = columns.find({x + dx, y + dy});
          if (found != columns.end()) around |= found->second;
        }
      }
      const double full_m = static_cast<double>(shell_.heights_m[static_cast<size_t>(i)] +
                                                shell_.depths_m[static_cast<size_t>(i)]);
      const auto bins = std::min<size_t>(kColumnBins, static_cast<size_t>(full_m / kColumnM));
      const auto top_bins = static_cast<size_t>(options_.wall_top_gap_m / kColumnM);
      if (bins <= 2 * top_bins) continue;
      size_t filled = 0;
      for (size_t bin = 0; bin < bins; ++bin) filled += around[bin] ? 1 : 0;
      size_t top = 0;
      for (size_t bin = bins - top_bins; bin + 1 < bins; ++bin) top += around[bin] ? 1 : 0;
      if (static_cast<double>(filled) < options_.column_share * static_cast<double>(bins)) continue;
      if (top + 2 >= top_bins) Part(i) = ShellPart::kWall;
    }
  }

  void MarkWalls() {
    std::vector<float> heights = shell_.heights_m;
    const auto high =
        heights.begin() + static_cast<int64_t>(0.98 * static_cast<double>(heights.size()));
    std::nth_element(heights.begin(), high, heights.end());
    const double top_min_m =
        std::min(options_.wall_reach_m, static_cast<double>(*high) - options_.shell.near_top_m);
    const std::vector<UprightRegion> regions = FindRegions();
    const std::vector<size_t> region_sizes = RegionSizes(regions);
    for (const UprightRegion& region : regions) {
      ShellWall wall = region.wall;
      if (wall.area_m2 < options_.wall_area_m2 || !ReachesUp(region, top_min_m)) continue;
      if (wall.end_m - wall.begin_m < options_.wall_width_m) continue;
      if (!graph_.is_oriented) TurnToRoom(&wall);
      if (IsFront(region, wall, region_sizes)) continue;
      shell_.walls.push_back(wall);
    }
    for (int i = 0; i < count(); ++i) {
      if (Part(i) == ShellPart::kNone && IsOnWall(i)) Part(i) = ShellPart::kWall;
    }
    MarkColumns();
  }

  bool IsOnWall(int cell) const {
    const Eigen::Vector3d point = Point(cell);
    return std::any_of(shell_.walls.begin(), shell_.walls.end(), [&](const ShellWall& wall) {
      const double distance_m = wall.DistanceTo(point);
      if (distance_m < -options_.wall_depth_m || distance_m > options_.wall_skin_m) return false;
      const double facing = std::abs(Normal(cell).cast<double>().dot(wall.normal_map));
      if (facing < options_.shell.across_cosine &&
          distance_m > options_.shell.across_share * options_.wall_skin_m) {
        return false;
      }
      return wall.IsBeside(point, options_.shell.wall_end_m);
    });
  }

  const CellGraph& graph_;
  const SegmentOptions& options_;
  float level_normal_;
  RoomShell shell_;
  std::vector<HeightMap> floor_maps_;
  HeightMap ceiling_map_;
};

}  // namespace

RoomShell FindRoomShell(const CellGraph& graph, const std::vector<double>& floors_m,
                        const SegmentOptions& options) {
  return ShellFinder(graph, options).Find(floors_m);
}

}  // namespace dsg::ingest
