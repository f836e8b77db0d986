// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/cover_space.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::ingest {
namespace {

// How densely to look, and how far a place covers.
struct Pass {
  double step_m = 0.0;
  double reach_m = 0.0;
  // What a place covers in narrow space, and by how much more per metre of its clearance.
  double reach_near_m = 0.0;
  double reach_rise = 0.0;
  // Cells and ways with less are left out.
  double radius_m = 0.0;
};

// Cells on a lattice that lies fast in the map, and which of them are covered.
class Cover {
 public:
  Cover(const OpenSpace& space, const Pass& pass) : space_(space), pass_(pass) {
    const GridFrame& frame = space.frame();
    step_ = std::max(1, static_cast<int>(std::lround(pass.step_m / frame.cell_m)));
    const Eigen::Vector3d shift = (frame.origin_map / frame.cell_m).array().round();
    for (int axis = 0; axis < 3; ++axis) {
      const auto over = static_cast<int64_t>(shift[axis]) % step_;
      first_[axis] = static_cast<int>((step_ - over) % step_);
    }
    if (space.IsFlat()) first_.z() = 0;
    for (int axis = 0; axis < 3; ++axis) {
      count_[axis] = std::max(0, (frame.size[axis] - first_[axis] + step_ - 1) / step_);
    }
    is_open_.assign(int64_t{count_.x()} * count_.y() * count_.z(), 0);
    ForEach(Eigen::Vector3i::Zero(), count_ - Eigen::Vector3i::Ones(),
            [&](int64_t i, int64_t c) { is_open_[i] = space_.Fits(c, pass_.radius_m) ? 1 : 0; });
  }

  void Mark(int64_t place) {
    const GridFrame& frame = space_.frame();
    const double reach_m =
        std::min(pass_.reach_m, pass_.reach_near_m + pass_.reach_rise * space_.ClearanceM(place));
    const int reach = static_cast<int>(reach_m / frame.cell_m);
    const Eigen::Vector3i at = frame.Cell(place);
    Eigen::Vector3i low;
    Eigen::Vector3i high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(0, (at[axis] - reach - first_[axis]) / step_);
      high[axis] = std::min(count_[axis] - 1, (at[axis] + reach - first_[axis]) / step_);
    }
    ForEach(low, high, [&](int64_t i, int64_t cell) {
      if (is_open_[i] == 0) return;
      const double distance_m = frame.cell_m * (frame.Cell(cell) - at).cast<double>().norm();
      if (distance_m > reach_m) return;
      if (cell == place || space_.IsWayFor(place, cell, pass_.radius_m)) is_open_[i] = 0;
    });
  }

  /// Uncovered cells, the widest first, as (index in the lattice, cell).
  std::vector<std::pair<int64_t, int64_t>> Uncovered() const {
    std::vector<std::pair<int64_t, int64_t>> open;
    ForEach(Eigen::Vector3i::Zero(), count_ - Eigen::Vector3i::Ones(), [&](int64_t i, int64_t c) {
      if (is_open_[i] != 0) open.emplace_back(i, c);
    });
    std::stable_sort(open.begin(), open.end(), [&](const auto& a, const auto& b) {
      return space_.ClearanceM(a.second) > space_.ClearanceM(b.second);
    });
    return open;
  }
  bool IsCovered(int64_t i) const { return is_open_[i] == 0; }

 private:
  template <typename Visit>
  void ForEach(const Eigen::Vector3i& low, const Eigen::Vector3i& high, const Visit& visit) const {
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const Eigen::Vector3i cell = first_ + step_ * Eigen::Vector3i(x, y, z);
          visit((int64_t{z} * count_.y() + y) * count_.x() + x, space_.frame().Index(cell));
        }
      }
    }
  }

  const OpenSpace& space_;
  Pass pass_;
  int step_ = 1;
  Eigen::Vector3i first_ = Eigen::Vector3i::Zero();
  Eigen::Vector3i count_ = Eigen::Vector3i::Zero();
  std::vector<uint8_t> is_open_;
};

// The nearest cell in straight reach where a robot fits; the cell itself when there is none.
int64_t NearestOpenInSight(const OpenSpace& space, int64_t cell, const Pass& pass) {
  const GridFrame& frame = space.frame();
  const Eigen::Vector3i at = frame.Cell(cell);
  const int reach = static_cast<int>(0.5 * pass.reach_m / frame.cell_m);
  const int up = space.IsFlat() ? 0 : reach;
  std::vector<std::pair<int, int64_t>> near;
  for (int z = -up; z <= up; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector3i next = at + Eigen::Vector3i(x, y, z);
        if (!frame.Holds(next) || !space.IsOpen(frame.Index(next))) continue;
        near.emplace_back(x * x + y * y + z * z, frame.Index(next));
      }
    }
  }
  std::sort(near.begin(), near.end());
  for (const auto& [squared, other] : near) {
    if (space.IsWayFor(cell, other, pass.radius_m)) return other;
  }
  return cell;
}

void RunPass(const Pass& pass, Roadmap* roadmap) {
  const OpenSpace& space = roadmap->space();
  Cover cover(space, pass);
  for (const int64_t cell : roadmap->cells()) cover.Mark(cell);
  for (const auto& [index, cell] : cover.Uncovered()) {
    if (cover.IsCovered(index)) continue;
    const int64_t place = space.IsOpen(cell) ? cell : NearestOpenInSight(space, cell, pass);
    roadmap->Add(place);
    cover.Mark(place);
  }
}

}  // namespace

void CoverPath(const std::vector<Eigen::Vector3d>& path_map, const PlaceOptions& options,
               Roadmap* roadmap) {
  const GridFrame& frame = roadmap->space().frame();
  for (const Eigen::Vector3d& point_map : path_map) {
    Eigen::Vector3i cell = frame.CellOf(point_map);
    if (roadmap->space().IsFlat()) cell.z() = 0;
    if (!frame.Holds(cell) || !roadmap->space().IsOpen(frame.Index(cell))) continue;
    if (roadmap->IsNearInSight(frame.Index(cell), options.path_reach_m)) continue;
    roadmap->Add(frame.Index(cell));
  }
}

void CoverSpace(const PlaceOptions& options, Roadmap* roadmap) {
  const OpenSpace& space = roadmap->space();
  const double radius_m = space.robot_radius_m();
  const double step_m = space.IsFlat() ? options.step_m : options.volume_step_m;
  Pass pass{step_m, options.volume_reach_m, options.volume_reach_m, 0.0, radius_m};
  if (space.IsFlat()) {
    pass = {step_m, options.reach_m, options.near_reach_m, options.reach_rise, radius_m};
  }
  RunPass(pass, roadmap);
  RunPass({step_m, options.corner_reach_m, options.corner_reach_m, 0.0,
           radius_m - space.frame().cell_m},
          roadmap);
}

}  // namespace dsg::ingest
