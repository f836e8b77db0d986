// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/places.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <set>

#include "schema/base/random.h"

namespace dsg::evaluation {
namespace {

/// Places by square of the floor, to find those near a point.
class PlaceFinder {
 public:
  PlaceFinder(const std::vector<EstimatedPlace>& places, const GridMap& map, double reach_m,
              double clearance_m)
      : places_(places), map_(map), reach_m_(reach_m), clearance_m_(clearance_m) {
    for (size_t i = 0; i < places.size(); ++i) {
      squares_[SquareOf(places[i].position_map.head<2>())].push_back(static_cast<int>(i));
    }
  }

  /// Places in straight-line reach until `visit` returns false; the order is fixed.
  void ForEach(const Eigen::Vector2d& point,
               const std::function<bool(int place, double distance_m)>& visit) const {
    const auto [column, row] = SquareOf(point);
    for (int64_t dy = -1; dy <= 1; ++dy) {
      for (int64_t dx = -1; dx <= 1; ++dx) {
        const auto found = squares_.find({column + dx, row + dy});
        if (found == squares_.end()) continue;
        for (const int place : found->second) {
          const Eigen::Vector2d at = places_[static_cast<size_t>(place)].position_map.head<2>();
          const double distance = (at - point).norm();
          if (distance > reach_m_ || !map_.IsStraightWay(point, at, clearance_m_)) continue;
          if (!visit(place, distance)) return;
        }
      }
    }
  }

 private:
  using Square = std::pair<int64_t, int64_t>;
  Square SquareOf(const Eigen::Vector2d& point) const {
    return {static_cast<int64_t>(std::floor(point.x() / reach_m_)),
            static_cast<int64_t>(std::floor(point.y() / reach_m_))};
  }

  const std::vector<EstimatedPlace>& places_;
  const GridMap& map_;
  double reach_m_;
  double clearance_m_;
  std::map<Square, std::vector<int>> squares_;
};

/// The graph of edges that do not collide.
struct Roads {
  std::vector<std::vector<std::pair<int, double>>> next;
};

Roads FindRoads(const std::vector<EstimatedPlace>& places, const std::vector<PlaceEdge>& edges,
                const GridMap& map, double clearance_m, PlaceResult* result) {
  std::set<PlaceEdge> once;
  for (const auto& [a, b] : edges) once.emplace(std::min(a, b), std::max(a, b));
  Roads roads;
  roads.next.resize(places.size());
  int64_t free_count = 0;
  for (const auto& [a, b] : once) {
    const Eigen::Vector2d from = places[static_cast<size_t>(a)].position_map.head<2>();
    const Eigen::Vector2d to = places[static_cast<size_t>(b)].position_map.head<2>();
    if (!map.IsStraightWay(from, to, clearance_m)) continue;
    ++free_count;
    roads.next[static_cast<size_t>(a)].emplace_back(b, (to - from).norm());
    roads.next[static_cast<size_t>(b)].emplace_back(a, (to - from).norm());
  }
  result->edge_count = static_cast<int64_t>(once.size());
  if (!once.empty()) {
    result->collision_free_ratio =
        static_cast<double>(free_count) / static_cast<double>(once.size());
  }
  return roads;
}

std::vector<size_t> SamplePoints(const GridMap& map, const PlaceOptions& options) {
  const truth::FreeGrid& grid = map.grid();
  const int step =
      std::max(1, static_cast<int>(std::lround(options.coverage_step_m / grid.cell_m)));
  std::vector<size_t> points;
  for (int y = step / 2; y < grid.height; y += step) {
    for (int x = step / 2; x < grid.width; x += step) {
      const auto cell =
          static_cast<size_t>(y) * static_cast<size_t>(grid.width) + static_cast<size_t>(x);
      const bool is_wanted = map.Has(cell, truth::kCellFree | truth::kCellObserved) &&
                             map.ClearanceOf(cell) > options.coverage_clearance_m;
      if (is_wanted) points.push_back(cell);
    }
  }
  return points;
}

// Places at which a way from or to a point may enter the graph, with their distances.
std::vector<std::pair<int, double>> Entries(const Eigen::Vector2d& point, const PlaceFinder& finder,
                                            double enter_m) {
  std::vector<std::pair<int, double>> near;
  std::pair<int, double> nearest(-1, kInfinity);
  finder.ForEach(point, [&](int place, double distance) {
    if (distance <= enter_m) near.emplace_back(place, distance);
    if (distance < nearest.second) nearest = {place, distance};
    return true;
  });
  if (near.empty() && nearest.first >= 0) near.push_back(nearest);
  return near;
}

// Lengths from a point over places, each to be ended by a straight way.
std::vector<double> LengthsFrom(const std::vector<std::pair<int, double>>& entries,
                                const Roads& roads) {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::vector<double> length(roads.next.size(), kInfinity);
  for (const auto& [place, distance] : entries) {
    length[static_cast<size_t>(place)] = distance;
    open.emplace(distance, place);
  }
  while (!open.empty()) {
    const auto [so_far, place] = open.top();
    open.pop();
    if (so_far > length[static_cast<size_t>(place)]) continue;
    for (const auto& [next, step] : roads.next[static_cast<size_t>(place)]) {
      double& best = length[static_cast<size_t>(next)];
      if (so_far + step >= best) continue;
      best = so_far + step;
      open.emplace(best, next);
    }
  }
  return length;
}

double LengthTo(const std::vector<std::pair<int, double>>& entries,
                const std::vector<double>& length) {
  double best = kInfinity;
  for (const auto& [place, distance] : entries) {
    best = std::min(best, length[static_cast<size_t>(place)] + distance);
  }
  return best;
}

void EvaluateWays(const std::vector<size_t>& points, const PlaceFinder& finder, const Roads& roads,
                  const GridMap& map, double clearance_m, const PlaceOptions& options,
                  PlaceResult* result) {
  Random random(options.seed, 0);
  std::vector<double> stretches;
  for (int i = 0; i < options.start_count; ++i) {
    const size_t start = points[static_cast<size_t>(random.Index(static_cast<int>(points.size())))];
    const std::vector<double> ways = map.WaysFrom(start, clearance_m);
    std::vector<size_t> goals;
    for (const size_t point : points) {
      if (ways[point] >= options.way_m_min && ways[point] < kInfinity) goals.push_back(point);
    }
    if (goals.empty()) continue;
    const std::vector<double> lengths =
        LengthsFrom(Entries(map.CenterOf(start), finder, options.enter_m), roads);
    for (int k = 0; k < options.goals_per_start; ++k) {
      const size_t goal = goals[static_cast<size_t>(random.Index(static_cast<int>(goals.size())))];
      const auto exits = Entries(map.CenterOf(goal), finder, options.enter_m);
      stretches.push_back(LengthTo(exits, lengths) / ways[goal]);
    }
  }
  if (stretches.empty()) return;
  result->pair_count = static_cast<int64_t>(stretches.size());
  std::sort(stretches.begin(), stretches.end());
  const auto first_lost = std::lower_bound(stretches.begin(), stretches.end(), kInfinity);
  result->connectivity =
      static_cast<double>(first_lost - stretches.begin()) / static_cast<double>(stretches.size());
  const double median = stretches[stretches.size() / 2];
  if (median < kInfinity) result->stretch_median = median;
}

}  // namespace

PlaceResult EvaluatePlaces(const std::vector<EstimatedPlace>& places,
                           const std::vector<PlaceEdge>& edges, const GridMap& map,
                           const PlaceOptions& options) {
  PlaceResult result;
  result.place_count = static_cast<int64_t>(places.size());
  if (places.empty() || map.cell_count() == 0) return result;
  // Rounding must not make three cells out of two.
  const double clearance_m = options.robot_radius_m - map.grid().cell_m - 1e-9;
  const Roads roads = FindRoads(places, edges, map, clearance_m, &result);
  const std::vector<size_t> points = SamplePoints(map, options);
  if (points.empty()) return result;
  const PlaceFinder finder(places, map, options.reach_m, clearance_m);
  int64_t covered = 0;
  for (const size_t point : points) {
    bool is_covered = false;
    finder.ForEach(map.CenterOf(point), [&is_covered](int, double) {
      is_covered = true;
      return false;
    });
    covered += is_covered ? 1 : 0;
  }
  result.coverage = static_cast<double>(covered) / static_cast<double>(points.size());
  int64_t free_count = 0;
  for (size_t cell = 0; cell < map.cell_count(); ++cell) {
    free_count += map.Has(cell, truth::kCellFree | truth::kCellObserved) ? 1 : 0;
  }
  const double area = static_cast<double>(free_count) * map.grid().cell_m * map.grid().cell_m;
  result.per_100_m2 = 100.0 * static_cast<double>(places.size()) / area;
  // Without edges there is no graph to walk.
  if (!edges.empty()) EvaluateWays(points, finder, roads, map, clearance_m, options, &result);
  return result;
}

}  // namespace dsg::evaluation
