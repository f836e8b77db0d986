// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/furniture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "ingest/rooms/outline.h"

namespace dsg::ingest {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Pieces of what is not free, and which of them are near each other.
class IslandFinder {
 public:
  IslandFinder(const FurnitureOptions& options, OccupancyGrid* plan)
      : options_(options), plan_(*plan), frame_(plan->frame), piece_of_(plan->cells.size(), -1) {}

  void Run() {
    for (size_t i = 0; i < piece_of_.size(); ++i) {
      if (IsSolid(i) && piece_of_[i] < 0) AddPiece(static_cast<int64_t>(i));
    }
    JoinNearPieces();
    for (size_t i = 0; i < pieces_.size(); ++i) {
      const size_t root = RootOf(i);
      if (root != i) pieces_[root].Take(pieces_[i]);
    }
    for (size_t i = 0; i < piece_of_.size(); ++i) {
      if (piece_of_[i] < 0) continue;
      if (IsIsland(pieces_[RootOf(static_cast<size_t>(piece_of_[i]))])) {
        plan_.cells[i] = Occupancy::kFree;
      }
    }
  }

 private:
  struct Piece {
    Eigen::AlignedBox2i box;
    int64_t cell_count = 0;
    bool is_seen = false;
    /// As large as a wall, or at one.
    bool is_wall = false;
    size_t parent = 0;

    void Take(const Piece& other) {
      box.extend(other.box);
      cell_count += other.cell_count;
      is_seen = is_seen || other.is_seen;
      is_wall = is_wall || other.is_wall;
    }
  };

  bool IsSolid(size_t i) const { return plan_.cells[i] != Occupancy::kFree; }

  // Calls `visit` with all cells at most `reach` columns and rows away.
  template <typename Visit>
  void VisitAround(int64_t index, int reach, const Visit& visit) const {
    const Eigen::Vector3i at = frame_.Cell(index);
    for (int y = std::max(0, at.y() - reach); y <= at.y() + reach && y < frame_.size.y(); ++y) {
      for (int x = std::max(0, at.x() - reach); x <= at.x() + reach && x < frame_.size.x(); ++x) {
        visit(frame_.Index({x, y, 0}));
      }
    }
  }

  void AddPiece(int64_t start) {
    const auto number = static_cast<int>(pieces_.size());
    Piece piece;
    piece.parent = pieces_.size();
    std::vector<int64_t> open(1, start);
    piece_of_[static_cast<size_t>(start)] = number;
    for (size_t next = 0; next < open.size(); ++next) {
      piece.box.extend(Eigen::Vector2i(frame_.Cell(open[next]).head<2>()));
      piece.is_seen |= plan_.cells[static_cast<size_t>(open[next])] == Occupancy::kOccupied;
      VisitAround(open[next], 1, [&](int64_t cell) {
        const auto i = static_cast<size_t>(cell);
        if (!IsSolid(i) || piece_of_[i] >= 0) return;
        piece_of_[i] = number;
        open.push_back(cell);
      });
    }
    piece.cell_count = static_cast<int64_t>(open.size());
    const bool is_at_rim = (piece.box.min().array() == 0).any() ||
                           (piece.box.max().array() + 1 == frame_.size.head<2>().array()).any();
    piece.is_wall = is_at_rim || SizeM(piece).maxCoeff() > LongestM();
    pieces_.push_back(piece);
  }

  // A wall that was seen in dashes is no row of legs.
  void JoinNearPieces() {
    const int reach = std::max(1, static_cast<int>(std::lround(options_.apart_m / frame_.cell_m)));
    for (size_t i = 0; i < piece_of_.size(); ++i) {
      if (piece_of_[i] < 0 || pieces_[static_cast<size_t>(piece_of_[i])].is_wall) continue;
      VisitAround(static_cast<int64_t>(i), reach, [&](int64_t cell) {
        const int other = piece_of_[static_cast<size_t>(cell)];
        if (other < 0 || other == piece_of_[i]) return;
        const size_t a = RootOf(static_cast<size_t>(piece_of_[i]));
        const size_t b = RootOf(static_cast<size_t>(other));
        pieces_[std::max(a, b)].parent = std::min(a, b);
      });
    }
  }

  size_t RootOf(size_t piece) {
    while (pieces_[piece].parent != piece) {
      pieces_[piece].parent = pieces_[pieces_[piece].parent].parent;
      piece = pieces_[piece].parent;
    }
    return piece;
  }

  Eigen::Vector2d SizeM(const Piece& piece) const {
    return frame_.cell_m * (piece.box.sizes().cast<double>().array() + 1).matrix();
  }
  double LongestM() const { return std::max(options_.leg_m_max, options_.block_long_m); }

  bool IsIsland(const Piece& piece) const {
    if (piece.is_wall || !piece.is_seen) return false;
    const Eigen::Vector2d size_m = SizeM(piece);
    if (size_m.maxCoeff() <= options_.leg_m_max) return true;
    const double area_m2 = static_cast<double>(piece.cell_count) * frame_.cell_m * frame_.cell_m;
    return size_m.minCoeff() >= options_.block_thick_m &&
           size_m.maxCoeff() <= options_.block_long_m &&
           area_m2 >= options_.block_filled * size_m.prod();
  }

  const FurnitureOptions& options_;
  OccupancyGrid& plan_;
  const GridFrame& frame_;
  std::vector<int> piece_of_;
  std::vector<Piece> pieces_;
};

class FloorCover {
 public:
  FloorCover(const FurnitureOptions& options, PlanRegions* regions)
      : options_(options),
        regions_(*regions),
        room_of_(regions->region_of.size(), -1),
        nearest_(regions->region_of.size(), std::numeric_limits<int>::max()) {}

  void Run() {
    const std::vector<Polygon2d> outlines = OutlinesOf(regions_);
    std::vector<std::vector<int64_t>> cells_of(outlines.size());
    for (size_t i = 0; i < regions_.region_of.size(); ++i) {
      const int room = regions_.region_of[i];
      if (room >= 0) cells_of[static_cast<size_t>(room)].push_back(static_cast<int64_t>(i));
    }
    for (size_t room = 0; room < outlines.size(); ++room) {
      TurnTo(MainAngle({outlines[room]}, 2.0 * regions_.frame.cell_m));
      for (const int64_t cell : CellsAround(static_cast<int>(room), cells_of[room])) {
        Consider(static_cast<int>(room), cell);
      }
    }
    for (size_t i = 0; i < room_of_.size(); ++i) {
      if (room_of_[i] >= 0) regions_.region_of[i] = room_of_[i];
    }
  }

 private:
  // Ways along the room's walls, as steps from cell to cell; opposite ones are 2 apart.
  void TurnTo(double angle) {
    const int count = static_cast<int>(options_.long_m / regions_.frame.cell_m) + 1;
    for (size_t way = 0; way < 4; ++way) {
      const double at = angle + 0.5 * static_cast<double>(way) * std::numbers::pi;
      const Eigen::Vector2d along(std::cos(at), std::sin(at));
      ways_[way].clear();
      for (int step = 0; step < count; ++step) {
        ways_[way].push_back((static_cast<double>(step) * along).array().round().cast<int>());
      }
    }
  }

  // Cells of no region around a room, no farther than furniture is deep.
  std::vector<int64_t> CellsAround(int room, const std::vector<int64_t>& cells) {
    const GridFrame& frame = regions_.frame;
    const int64_t width = frame.size.x();
    const int rounds = static_cast<int>(std::lround(options_.deep_m / frame.cell_m));
    std::vector<int64_t> found;
    std::vector<int64_t> front = cells;
    std::vector<int64_t> next;
    for (int round = 0; round < rounds && !front.empty(); ++round) {
      next.clear();
      for (const int64_t cell : front) {
        const int64_t column = cell % width;
        const auto visit = [&](int64_t beside) {
          const auto i = static_cast<size_t>(beside);
          if (regions_.region_of[i] >= 0 || seen_by_[i] == room) return;
          seen_by_[i] = room;
          next.push_back(beside);
        };
        if (column > 0) visit(cell - 1);
        if (column + 1 < width) visit(cell + 1);
        if (cell >= width) visit(cell - width);
        if (cell + width < frame.CellCount()) visit(cell + width);
      }
      found.insert(found.end(), next.begin(), next.end());
      front.swap(next);
    }
    return found;
  }

  int RoomAt(const Eigen::Vector2i& cell) const {
    const Eigen::Vector3i& size = regions_.frame.size;
    if (cell.x() < 0 || cell.y() < 0 || cell.x() >= size.x() || cell.y() >= size.y()) return -1;
    return regions_.region_of[static_cast<size_t>(int64_t{cell.y()} * size.x() + cell.x())];
  }

  // After how many steps the room begins, over cells of no room; -1 if another one comes first.
  int StepsToRoom(int room, const Eigen::Vector2i& from, size_t way) const {
    for (size_t step = 1; step < ways_[way].size(); ++step) {
      const int other = RoomAt(from + ways_[way][step]);
      if (other >= 0) return other == room ? static_cast<int>(step) : -1;
    }
    return -1;
  }

  // After how many steps a room ends at its wall; kNever if another room comes first.
  double StepsToWall(int room, const Eigen::Vector2i& from, size_t way) const {
    for (size_t step = 0; step < ways_[way].size(); ++step) {
      const int other = RoomAt(from + ways_[way][step]);
      if (other < 0) return static_cast<double>(step);
      if (other != room) return kNever;
    }
    return kNever;
  }

  void Consider(int room, int64_t index) {
    const Eigen::Vector2i cell = regions_.frame.Cell(index).head<2>();
    std::array<int, 4> steps;
    for (size_t way = 0; way < 4; ++way) steps[way] = StepsToRoom(room, cell, way);
    int nearest = std::numeric_limits<int>::max();
    for (const int count : steps) nearest = count > 0 ? std::min(nearest, count) : nearest;
    const auto i = static_cast<size_t>(index);
    if (nearest >= nearest_[i] || !IsUnderFurniture(room, cell, steps)) return;
    nearest_[i] = nearest;
    room_of_[i] = room;
  }

  // `steps`: to the room along each way, -1 = never.
  bool IsUnderFurniture(int room, const Eigen::Vector2i& cell,
                        const std::array<int, 4>& steps) const {
    for (size_t front = 0; front < 4; ++front) {
      if (steps[front] < 0) continue;
      const size_t back = (front + 2) % 4;
      double width = 0.0, behind = 0.0;
      bool is_open = false;
      // Beside it the room goes on to the wall behind it, and before it to the wall at its side.
      for (const size_t side : {(front + 1) % 4, (front + 3) % 4}) {
        if (steps[side] > 0) {
          is_open = true;
          width += steps[side];
          const Eigen::Vector2i beside = cell + StepOf(side, steps[side]);
          behind = std::max(behind, StepsToWall(room, beside, back));
        } else {
          width += StepsToWall(room, cell + StepOf(front, steps[front]), side);
        }
      }
      if (is_open && Fits(width, steps[front] + behind)) return true;
    }
    return false;
  }

  const Eigen::Vector2i& StepOf(size_t way, int step) const {
    return ways_[way][static_cast<size_t>(step)];
  }

  // In steps. One more from rim to rim than the thing is wide.
  bool Fits(double width, double depth) const {
    const double least_m = (std::min(width, depth) - 1.0) * regions_.frame.cell_m;
    const double most_m = (std::max(width, depth) - 1.0) * regions_.frame.cell_m;
    return least_m >= options_.thin_m && least_m <= options_.deep_m && most_m <= options_.long_m;
  }

  const FurnitureOptions& options_;
  PlanRegions& regions_;
  std::array<std::vector<Eigen::Vector2i>, 4> ways_;
  /// The room that has each cell under its furniture, and how many steps away that is.
  std::vector<int> room_of_;
  std::vector<int> nearest_;
  /// The last room that came by a cell.
  std::vector<int> seen_by_ = std::vector<int>(room_of_.size(), -1);
};

}  // namespace

void FreeIslands(const FurnitureOptions& options, OccupancyGrid* plan) {
  IslandFinder(options, plan).Run();
}

void CoverFurniture(const FurnitureOptions& options, PlanRegions* regions) {
  // The second time, what stands in a corner behind two other things.
  for (int time = 0; time < 2; ++time) FloorCover(options, regions).Run();
}

}  // namespace dsg::ingest
