// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/rooms.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "schema/matching/assignment.h"

namespace dsg::evaluation {
namespace {

/// How much predicted and true rooms share; rows are predicted rooms.
struct Overlap {
  Eigen::MatrixXd shared;
  Eigen::VectorXd predicted_size;
  Eigen::VectorXd true_size;

  Overlap(Eigen::Index predicted_count, Eigen::Index true_count)
      : shared(Eigen::MatrixXd::Zero(predicted_count, true_count)),
        predicted_size(Eigen::VectorXd::Zero(predicted_count)),
        true_size(Eigen::VectorXd::Zero(true_count)) {}

  /// -1 = in none.
  void Add(int predicted, int truth) {
    if (predicted >= 0) predicted_size[predicted] += 1.0;
    if (truth >= 0) true_size[truth] += 1.0;
    if (predicted >= 0 && truth >= 0) shared(predicted, truth) += 1.0;
  }
};

int RoomAt(const std::vector<Polygon2d>& footprints, const Eigen::Vector2d& point) {
  for (size_t i = 0; i < footprints.size(); ++i) {
    if (footprints[i].size() >= 3 && PolygonContains(footprints[i], point)) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

double Ratio(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

// True room of each cell that is free and observed, else -1; and which rooms are asked for.
struct TrueCells {
  std::vector<int> room_of;
  std::vector<bool> is_asked;
};

TrueCells FindTrueCells(const TrueRooms& truth, const GridMap& map, double observed_min) {
  const size_t room_count = truth.footprints_map.size();
  TrueCells cells{std::vector<int>(map.cell_count(), -1), std::vector<bool>(room_count, true)};
  if (map.cell_count() == 0) return cells;
  std::vector<int64_t> free_count(room_count, 0);
  std::vector<int64_t> observed_count(room_count, 0);
  for (size_t cell = 0; cell < map.cell_count(); ++cell) {
    if (!map.Has(cell, truth::kCellFree)) continue;
    const int room = RoomAt(truth.footprints_map, map.CenterOf(cell));
    if (room < 0) continue;
    ++free_count[static_cast<size_t>(room)];
    if (!map.Has(cell, truth::kCellObserved)) continue;
    ++observed_count[static_cast<size_t>(room)];
    cells.room_of[cell] = room;
  }
  for (size_t i = 0; i < room_count; ++i) {
    cells.is_asked[i] =
        observed_count[i] > 0 &&
        static_cast<double>(observed_count[i]) >= observed_min * static_cast<double>(free_count[i]);
  }
  return cells;
}

Overlap OverlapInPlaces(const PredictedRooms& predicted, const TrueRooms& truth, const GridMap& map,
                        bool with_door_bands) {
  Overlap overlap(predicted.count, static_cast<Eigen::Index>(truth.footprints_map.size()));
  for (const RoomPlace& place : predicted.places) {
    const Eigen::Vector2d at = place.position_map.head<2>();
    const std::optional<size_t> cell = map.CellAt(at);
    const bool is_in_band = cell.has_value() && map.Has(*cell, truth::kCellDoorBand);
    if (is_in_band && !with_door_bands) continue;
    overlap.Add(place.room, RoomAt(truth.footprints_map, at));
  }
  return overlap;
}

PrecisionRecall PaperScore(const Overlap& overlap, const std::vector<bool>& is_asked) {
  double precision = 0.0;
  double recall = 0.0;
  int64_t count = 0;
  for (Eigen::Index truth = 0; truth < overlap.true_size.size(); ++truth) {
    if (!is_asked[static_cast<size_t>(truth)]) continue;
    ++count;
    Eigen::Index best = 0;
    const double shared = overlap.shared.col(truth).maxCoeff(&best);
    if (shared == 0.0) continue;
    precision += Ratio(shared, overlap.predicted_size[best]);
    recall += Ratio(shared, overlap.true_size[truth]);
  }
  if (count == 0) return {};
  return {precision / static_cast<double>(count), recall / static_cast<double>(count)};
}

// Cells of the union of a room's discs.
std::set<size_t> DiscCells(const PredictedRooms& predicted, int room, const GridMap& map) {
  std::set<size_t> cells;
  const double cell_m = map.grid().cell_m;
  for (const RoomPlace& place : predicted.places) {
    if (place.room != room) continue;
    const Eigen::Vector2d center = place.position_map.head<2>();
    // A clearance beyond the grid's size would only be a mistake that takes long.
    const double radius = std::min(place.clearance_m, 20.0);
    for (double y = -radius - cell_m; y <= radius + cell_m; y += cell_m) {
      for (double x = -radius - cell_m; x <= radius + cell_m; x += cell_m) {
        const auto cell = map.CellAt(center + Eigen::Vector2d(x, y));
        if (cell.has_value() && (map.CenterOf(*cell) - center).norm() <= radius) {
          cells.insert(*cell);
        }
      }
    }
  }
  return cells;
}

PrecisionRecall VolumetricScore(const PredictedRooms& predicted, const TrueCells& cells,
                                const GridMap& map) {
  const auto true_count = static_cast<Eigen::Index>(cells.is_asked.size());
  Overlap overlap(predicted.count, true_count);
  for (const int room : cells.room_of) {
    if (room >= 0) overlap.true_size[room] += 1.0;
  }
  for (int room = 0; room < predicted.count; ++room) {
    for (const size_t cell : DiscCells(predicted, room, map)) {
      // Free and never seen: nobody can say whose it is.
      const bool is_unseen =
          map.Has(cell, truth::kCellFree) && !map.Has(cell, truth::kCellObserved);
      if (is_unseen) continue;
      overlap.predicted_size[room] += 1.0;
      if (cells.room_of[cell] >= 0) overlap.shared(room, cells.room_of[cell]) += 1.0;
    }
  }
  if (true_count == 0) return {};
  double precision = 0.0;
  int64_t seen_count = 0;
  for (Eigen::Index room = 0; room < predicted.count; ++room) {
    if (overlap.predicted_size[room] == 0.0) continue;
    ++seen_count;
    precision += Ratio(overlap.shared.row(room).maxCoeff(), overlap.predicted_size[room]);
  }
  PrecisionRecall score;
  if (seen_count > 0) score.precision = precision / static_cast<double>(seen_count);
  double recall = 0.0;
  int64_t count = 0;
  for (Eigen::Index truth = 0; truth < true_count; ++truth) {
    if (!cells.is_asked[static_cast<size_t>(truth)]) continue;
    ++count;
    recall += Ratio(overlap.shared.col(truth).maxCoeff(), overlap.true_size[truth]);
  }
  if (count > 0) score.recall = recall / static_cast<double>(count);
  return score;
}

PrecisionRecall OneToOneScore(const Overlap& overlap, const std::vector<int>& truth_of,
                              const std::vector<bool>& is_asked) {
  double precision = 0.0;
  double recall = 0.0;
  for (size_t room = 0; room < truth_of.size(); ++room) {
    const int truth = truth_of[room];
    if (truth < 0) continue;
    const auto row = static_cast<Eigen::Index>(room);
    precision += Ratio(overlap.shared(row, truth), overlap.predicted_size[row]);
    if (is_asked[static_cast<size_t>(truth)]) {
      recall += Ratio(overlap.shared(row, truth), overlap.true_size[truth]);
    }
  }
  const auto asked = std::count(is_asked.begin(), is_asked.end(), true);
  PrecisionRecall score;
  score.precision = precision / static_cast<double>(truth_of.size());
  if (asked > 0) score.recall = recall / static_cast<double>(asked);
  return score;
}

std::optional<double> AdjacencyF1(const PredictedRooms& predicted, const TrueRooms& truth,
                                  const std::vector<int>& truth_of,
                                  const std::vector<bool>& is_asked) {
  const auto ordered = [](int a, int b) { return RoomPair(std::min(a, b), std::max(a, b)); };
  const auto asked = [&is_asked](int room) { return is_asked[static_cast<size_t>(room)]; };
  std::set<RoomPair> doors;
  for (const auto& [a, b] : truth.doors) {
    if (a != b && asked(a) && asked(b)) doors.insert(ordered(a, b));
  }
  std::set<RoomPair> once;
  for (const auto& [a, b] : predicted.adjacent) once.insert(ordered(a, b));
  if (once.empty()) return std::nullopt;
  int64_t hits = 0;
  int64_t counted = 0;
  for (const auto& [a, b] : once) {
    const int true_a = truth_of[static_cast<size_t>(a)];
    const int true_b = truth_of[static_cast<size_t>(b)];
    const bool is_matched = true_a >= 0 && true_b >= 0;
    // A way into a room that is not asked for is neither right nor wrong.
    if (is_matched && (!asked(true_a) || !asked(true_b))) continue;
    ++counted;
    hits += is_matched && doors.contains(ordered(true_a, true_b)) ? 1 : 0;
  }
  const double sum = static_cast<double>(counted) + static_cast<double>(doors.size());
  if (sum == 0.0) return std::nullopt;
  return 2.0 * static_cast<double>(hits) / sum;
}

}  // namespace

RoomResult EvaluateRooms(const PredictedRooms& predicted, const TrueRooms& truth,
                         const GridMap& map, const RoomOptions& options) {
  RoomResult result;
  const TrueCells cells = FindTrueCells(truth, map, options.observed_min);
  result.count_truth = std::count(cells.is_asked.begin(), cells.is_asked.end(), true);
  if (predicted.count == 0) return result;
  result.count = predicted.count;
  const Overlap overlap = OverlapInPlaces(predicted, truth, map, /*with_door_bands=*/true);
  const Overlap without = OverlapInPlaces(predicted, truth, map, /*with_door_bands=*/false);
  result.of_places = PaperScore(overlap, cells.is_asked);
  result.outside_doors = PaperScore(without, cells.is_asked);
  if (map.cell_count() > 0) result.volumetric = VolumetricScore(predicted, cells, map);
  const std::vector<int> truth_of = MaximumAssignment(overlap.shared);
  result.one_to_one = OneToOneScore(overlap, truth_of, cells.is_asked);
  result.adjacency_f1 = AdjacencyF1(predicted, truth, truth_of, cells.is_asked);
  return result;
}

}  // namespace dsg::evaluation
