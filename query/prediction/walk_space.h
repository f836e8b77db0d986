// SPDX-License-Identifier: Apache-2.0
// Where people can walk: a graph of places, an index of what is near a position, and what is known
// to be free, the clearances of places taken together. What no clearance covers counts as a wall.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Where people can walk, as points and links.
struct WalkGraph {
  std::vector<Eigen::Vector3d> places_map;
  /// Distance to the nearest obstacle at each place, metres.
  std::vector<double> clearance_m;
  /// Undirected, by index.
  std::vector<std::pair<int, int>> links;
  /// Kept from obstacles along each link, metres; empty = all keep GoalOptions::clearance_m_min.
  std::vector<double> link_clearance_m;
};

/// Torso and place of one storey differ by less than this.
inline constexpr double kStoreyHeightM = 1.5;

/// Distance on the floor plan, metres.
inline double Horizontal(const Eigen::Vector3d& a_map, const Eigen::Vector3d& b_map) {
  return (a_map - b_map).head<2>().norm();
}

/// Numbered things by their position on the floor plan, in square cells. Knows neither heights nor
/// exact distances: it gives candidates.
///
/// Threads: not changed by reading.
class CellMap {
 public:
  explicit CellMap(double size_m) : size_m_(size_m) {}

  /// Cost: the cells that the square around the position touches.
  void Add(const Eigen::Vector3d& position_map, double half_side_m, int item) {
    const Range range = RangeAround(position_map, half_side_m);
    for (int32_t x = range.x_begin; x <= range.x_end; ++x) {
      for (int32_t y = range.y_begin; y <= range.y_end; ++y) {
        cells_[{x, y}].push_back(item);
        ++entry_count_;
      }
    }
  }

  /// What was added around a position, in the order of adding. Valid until more is added.
  const std::vector<int>& At(const Eigen::Vector3d& position_map) const {
    const auto found = cells_.find({CellOf(position_map.x()), CellOf(position_map.y())});
    return found == cells_.end() ? none_ : found->second;
  }

  /// All that was added with a half side of 0 no further than `reach_m` from a position, and some
  /// that is further away; each once, in no useful order. Calls `visit(item)`.
  template <typename Visit>
  void ForEachAround(const Eigen::Vector3d& position_map, double reach_m,
                     const Visit& visit) const {
    const Range range = RangeAround(position_map, reach_m + kRoundingM);
    const double cell_count = (static_cast<double>(range.x_end) - range.x_begin + 1.0) *
                              (static_cast<double>(range.y_end) - range.y_begin + 1.0);
    if (cell_count > static_cast<double>(cells_.size())) {
      for (const auto& [cell, items] : cells_) {
        for (const int item : items) visit(item);
      }
      return;
    }
    for (int32_t x = range.x_begin; x <= range.x_end; ++x) {
      for (int32_t y = range.y_begin; y <= range.y_end; ++y) {
        const auto found = cells_.find({x, y});
        if (found == cells_.end()) continue;
        for (const int item : found->second) visit(item);
      }
    }
  }

  size_t memory_bytes() const {
    return sizeof(CellMap) + cells_.size() * (sizeof(*cells_.begin()) + 16) +
           entry_count_ * sizeof(int);
  }

 private:
  // More than what adding two coordinates of any map loses.
  static constexpr double kRoundingM = 1e-6;

  struct Cell {
    int32_t x = 0;
    int32_t y = 0;
    bool operator==(const Cell&) const = default;
  };
  struct Hash {
    size_t operator()(const Cell& cell) const {
      const uint64_t both =
          uint64_t{static_cast<uint32_t>(cell.x)} << 32 | static_cast<uint32_t>(cell.y);
      return static_cast<size_t>((both ^ both >> 29) * 0x9e3779b97f4a7c15ull >> 16);
    }
  };
  struct Range {
    int32_t x_begin = 0;
    int32_t x_end = 0;
    int32_t y_begin = 0;
    int32_t y_end = 0;
  };

  int32_t CellOf(double coordinate_m) const;
  Range RangeAround(const Eigen::Vector3d& position_map, double half_side_m) const {
    return {CellOf(position_map.x() - half_side_m), CellOf(position_map.x() + half_side_m),
            CellOf(position_map.y() - half_side_m), CellOf(position_map.y() + half_side_m)};
  }

  double size_m_;
  std::vector<int> none_;
  std::unordered_map<Cell, std::vector<int>, Hash> cells_;
  size_t entry_count_ = 0;
};

/// The places and links of a walk graph near a position, as candidates.
///
/// Distances are horizontal.
///
/// Threads: not changed after construction.
class WalkIndex {
 public:
  /// Errors: what `stop` returned.
  static absl::StatusOr<WalkIndex> Make(const WalkGraph& graph, const StopCheck& stop);

  /// All places no further than that, and some that are. Order: ascending.
  std::vector<int> PlacesNear(const Eigen::Vector3d& position_map, double reach_m) const;
  /// The same of links, by the nearest point of each.
  std::vector<int> LinksNear(const Eigen::Vector3d& position_map, double reach_m) const;
  /// Of all places.
  double clearance_m_max() const { return clearance_m_max_; }

  size_t memory_bytes() const { return places_.memory_bytes() + links_.memory_bytes(); }

 private:
  WalkIndex();

  CellMap places_;
  // By their middles.
  CellMap links_;
  double clearance_m_max_ = 0.0;
  double half_link_m_max_ = 0.0;
};

/// What is known to be free: the clearances of places, taken together. The rest counts as a wall.
///
/// Distances are horizontal, within a storey.
///
/// Threads: not changed after construction. Cost: to build, some dozen cells a place; to ask, the
/// places around the point.
class FreeSpace {
 public:
  /// Copies what it needs. Errors: what `stop` returned.
  static absl::StatusOr<FreeSpace> Make(const WalkGraph& graph, const StopCheck& stop);

  /// A circle of this radius around the point is free; less than 0 where nothing is known.
  double RadiusM(const Eigen::Vector3d& point_map) const;
  /// Whether a straight line is free, and keeps `margin_m` less 5 cm from what is not.
  /// Requires: a margin above 5 cm.
  bool IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
               double margin_m) const;

  size_t memory_bytes() const { return balls_.capacity() * sizeof(Ball) + cells_.memory_bytes(); }

 private:
  struct Ball {
    Eigen::Vector3d centre_map;
    double radius_m = 0.0;
  };

  FreeSpace();

  // The largest first.
  std::vector<Ball> balls_;
  CellMap cells_;
};

}  // namespace dsg::query
