// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/voronoi_places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

// Whether two obstacle cells, as seen from a cell, are different ones.
bool AreApart(const OpenSpace& space, const PlaceOptions& options, const Eigen::Vector3i& cell,
              int64_t a, int64_t b) {
  if (a == b || a < 0 || b < 0) return false;
  const GridFrame& frame = space.frame();
  const Eigen::Vector3d to_a = (frame.Cell(a) - cell).cast<double>();
  const Eigen::Vector3d to_b = (frame.Cell(b) - cell).cast<double>();
  const double apart_m = frame.cell_m * (to_a - to_b).norm();
  if (apart_m < options.basis_radii * space.robot_radius_m()) return false;
  return to_a.dot(to_b) < options.basis_cosine * to_a.norm() * to_b.norm();
}

// One way along each axis; the diagram has no gaps that these would leave.
std::vector<int64_t> FindDiagram(const OpenSpace& space, const PlaceOptions& options) {
  const GridFrame& frame = space.frame();
  const DistanceField& field = space.field();
  const std::array<int64_t, 3> strides = {1, frame.size.x(),
                                          int64_t{frame.size.x()} * frame.size.y()};
  std::vector<uint8_t> is_in(frame.CellCount(), 0);
  for (int64_t i = 0; i < frame.CellCount(); ++i) {
    if (!space.IsOpen(i)) continue;
    const Eigen::Vector3i cell = frame.Cell(i);
    const int64_t mine = field.NearestObstacle(i);
    for (int axis = 0; axis < 3; ++axis) {
      if (cell[axis] + 1 >= frame.size[axis]) continue;
      const int64_t next = i + strides[static_cast<size_t>(axis)];
      const int64_t other = field.NearestObstacle(next);
      const int64_t apart = std::abs(mine - other);
      // The same obstacle, or the next cell of one.
      if (apart == 0 || apart == strides[0] || apart == strides[1] || apart == strides[2]) continue;
      if (!space.IsOpen(next) || !AreApart(space, options, cell, mine, other)) continue;
      is_in[i] = 1;
      is_in[next] = 1;
    }
  }
  std::vector<int64_t> cells;
  for (int64_t i = 0; i < frame.CellCount(); ++i) {
    if (is_in[i] != 0) cells.push_back(i);
  }
  return cells;
}

// A part of the diagram within one block of the map.
struct Part {
  int64_t best_cell = -1;
  int spot = -1;
};

// Where two parts touch.
struct Border {
  int64_t best_cell = -1;
};

class Diagram {
 public:
  Diagram(const OpenSpace& space, const PlaceOptions& options)
      : space_(space),
        block_m_(options.block_m),
        cells_(FindDiagram(space, options)),
        sets_(cells_.size()) {
    JoinParts();
    CollectParts();
    CollectBorders();
  }

  std::vector<Part>& parts() { return parts_; }
  const std::map<std::pair<int, int>, Border>& borders() const { return borders_; }

 private:
  // Blocks lie fast in the map, so that places stay while it grows.
  Eigen::Vector3i BlockOf(int64_t cell) const {
    const Eigen::Vector3d block = (space_.CenterOf(cell) / block_m_).array().floor();
    return block.cast<int>();
  }

  int Find(int64_t cell) const {
    const auto found = std::lower_bound(cells_.begin(), cells_.end(), cell);
    if (found == cells_.end() || *found != cell) return -1;
    return static_cast<int>(found - cells_.begin());
  }

  // Calls for all pairs of touching cells, once per pair.
  template <typename Visit>
  void ForEachPair(const Visit& visit) const {
    const GridFrame& frame = space_.frame();
    for (int i = 0; i < static_cast<int>(cells_.size()); ++i) {
      const Eigen::Vector3i cell = frame.Cell(cells_[static_cast<size_t>(i)]);
      for (const Eigen::Vector3i& offset : space_.neighbours()) {
        const Eigen::Vector3i next = cell + offset;
        if (!frame.Holds(next) || frame.Index(next) < cells_[static_cast<size_t>(i)]) continue;
        const int other = Find(frame.Index(next));
        if (other >= 0) visit(i, other);
      }
    }
  }

  void JoinParts() {
    std::vector<Eigen::Vector3i> blocks;
    blocks.reserve(cells_.size());
    for (const int64_t cell : cells_) blocks.push_back(BlockOf(cell));
    ForEachPair([&](int a, int b) {
      if (blocks[static_cast<size_t>(a)] != blocks[static_cast<size_t>(b)]) return;
      sets_.Merge(a, b);
    });
  }

  bool IsWider(int64_t cell, int64_t than) const {
    return than < 0 || space_.ClearanceM(cell) > space_.ClearanceM(than);
  }

  void CollectParts() {
    part_of_.assign(cells_.size(), -1);
    for (int i = 0; i < static_cast<int>(cells_.size()); ++i) {
      const int root = sets_.Find(i);
      if (root == i) {
        part_of_[static_cast<size_t>(i)] = static_cast<int>(parts_.size());
        parts_.emplace_back();
      }
      const int part = part_of_[static_cast<size_t>(root)];
      part_of_[static_cast<size_t>(i)] = part;
      int64_t& best = parts_[static_cast<size_t>(part)].best_cell;
      const int64_t cell = cells_[static_cast<size_t>(i)];
      if (IsWider(cell, best)) best = cell;
    }
  }

  void CollectBorders() {
    ForEachPair([&](int a, int b) {
      const int part_a = part_of_[static_cast<size_t>(a)];
      const int part_b = part_of_[static_cast<size_t>(b)];
      if (part_a == part_b) return;
      Border& border = borders_[{std::min(part_a, part_b), std::max(part_a, part_b)}];
      for (const int i : {a, b}) {
        const int64_t cell = cells_[static_cast<size_t>(i)];
        if (IsWider(cell, border.best_cell)) border.best_cell = cell;
      }
    });
  }

  const OpenSpace& space_;
  const double block_m_;
  std::vector<int64_t> cells_;
  DisjointSets sets_;
  std::vector<int> part_of_;
  std::vector<Part> parts_;
  std::map<std::pair<int, int>, Border> borders_;
};

// The widest parts first; a part whose best cell is near a place already is served by that.
void AddParts(double merge_m, std::vector<Part>* parts, Roadmap* roadmap) {
  const OpenSpace& space = roadmap->space();
  std::vector<int> order(parts->size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return space.ClearanceM((*parts)[static_cast<size_t>(a)].best_cell) >
           space.ClearanceM((*parts)[static_cast<size_t>(b)].best_cell);
  });
  for (const int i : order) {
    Part& part = (*parts)[static_cast<size_t>(i)];
    for (const auto& [distance_m, spot] : roadmap->Near(space.CenterOf(part.best_cell), merge_m)) {
      if (!space.IsOpenWay(part.best_cell, roadmap->cell(spot))) continue;
      part.spot = spot;
      break;
    }
    if (part.spot < 0) part.spot = roadmap->Add(part.best_cell);
  }
}

}  // namespace

int CountBasisPoints(const OpenSpace& space, int64_t cell, const PlaceOptions& options) {
  const GridFrame& frame = space.frame();
  const Eigen::Vector3i at = frame.Cell(cell);
  std::vector<int64_t> basis;
  const auto count = [&](int64_t index) {
    const int64_t obstacle = space.field().NearestObstacle(index);
    if (obstacle < 0) return;
    for (const int64_t known : basis) {
      if (!AreApart(space, options, at, known, obstacle)) return;
    }
    basis.push_back(obstacle);
  };
  count(cell);
  for (const Eigen::Vector3i& offset : space.neighbours()) {
    if (frame.Holds(at + offset)) count(frame.Index(at + offset));
  }
  return static_cast<int>(basis.size());
}

void AddVoronoiPlaces(const PlaceOptions& options, Roadmap* roadmap) {
  Diagram diagram(roadmap->space(), options);
  AddParts(options.merge_m, &diagram.parts(), roadmap);
  for (const auto& [pair, border] : diagram.borders()) {
    const int a = diagram.parts()[static_cast<size_t>(pair.first)].spot;
    const int b = diagram.parts()[static_cast<size_t>(pair.second)].spot;
    if (a == b || roadmap->Link(a, b)) continue;
    if (roadmap->IsNearInSight(border.best_cell, options.merge_m)) continue;
    const int middle = roadmap->Add(border.best_cell);
    roadmap->Link(a, middle);
    roadmap->Link(middle, b);
  }
}

}  // namespace dsg::ingest
