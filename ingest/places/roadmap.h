// SPDX-License-Identifier: Apache-2.0
// Places in the making: cells of an open space and the straight ways between them.
// Refuses ways on which a robot does not fit.
#pragma once

#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "ingest/places/open_space.h"

namespace dsg::ingest {

/// Spots are numbered in the order in which they were added.
///
/// Threads: one caller at a time.
class Roadmap {
 public:
  /// `space` must outlive this.
  explicit Roadmap(const OpenSpace* space) : space_(space) {}

  const OpenSpace& space() const { return *space_; }
  const std::vector<int64_t>& cells() const { return cells_; }
  int spot_count() const { return static_cast<int>(cells_.size()); }
  int64_t cell(int spot) const { return cells_[static_cast<size_t>(spot)]; }
  Eigen::Vector3d position_map(int spot) const { return space_->CenterOf(cell(spot)); }
  /// Each once, the lower spot first, ascending.
  const std::set<std::pair<int, int>>& links() const { return links_; }

  /// The spot of a cell; a new one unless there is one.
  int Add(int64_t cell);
  /// -1 when the cell is no spot.
  int SpotAt(int64_t cell) const;
  /// Links two spots when a robot fits between them, and says whether they are linked now.
  bool Link(int a, int b);
  bool IsLinked(int a, int b) const;
  /// Spots within a distance of a point, nearest first, then the lower one.
  std::vector<std::pair<double, int>> Near(const Eigen::Vector3d& point_map, double range_m) const;
  /// Whether a spot is within a distance of a cell and in straight reach of it.
  bool IsNearInSight(int64_t cell, double range_m) const;

 private:
  using Bin = std::array<int, 3>;
  static Bin BinOf(const Eigen::Vector3d& point_map);

  const OpenSpace* space_;
  std::vector<int64_t> cells_;
  std::map<int64_t, int> spot_at_;
  std::map<Bin, std::vector<int>> bins_;
  std::set<std::pair<int, int>> links_;
};

}  // namespace dsg::ingest
