// SPDX-License-Identifier: Apache-2.0
// Numbered things by where they are on the floor plan, in square cells.
// Refuses to know heights and exact distances: it gives candidates.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace dsg::query {

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

}  // namespace dsg::query
