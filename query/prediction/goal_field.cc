// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "query/prediction/prediction.h"
#include "schema/base/check.h"

namespace dsg::query {
namespace {

struct Neighbour {
  int place = 0;
  double way_m = 0.0;
};
using Neighbours = std::vector<std::vector<Neighbour>>;

bool IsPlace(int place, const WalkGraph& graph) {
  return place >= 0 && static_cast<size_t>(place) < graph.places_map.size();
}

void CheckGraph(const WalkGraph& graph, const std::vector<Goal>& goals) {
  DSG_CHECK(graph.clearance_m.size() == graph.places_map.size());
  for (const Eigen::Vector3d& place_map : graph.places_map) DSG_CHECK(place_map.allFinite());
  for (const double clearance_m : graph.clearance_m) {
    DSG_CHECK(clearance_m >= 0.0 && std::isfinite(clearance_m));
  }
  for (const auto& [a, b] : graph.links) DSG_CHECK(IsPlace(a, graph) && IsPlace(b, graph));
  for (const Goal& goal : goals) {
    DSG_CHECK(IsPlace(goal.place, graph));
    DSG_CHECK(goal.prior >= 0.0 && std::isfinite(goal.prior));
  }
}

Neighbours ListNeighbours(const WalkGraph& graph) {
  Neighbours neighbours(graph.places_map.size());
  for (const auto& [a, b] : graph.links) {
    const double way_m = (graph.places_map[a] - graph.places_map[b]).norm();
    neighbours[a].push_back({b, way_m});
    neighbours[b].push_back({a, way_m});
  }
  return neighbours;
}

/// Dijkstra from the goal; both arrays hold a number for each place.
void SpreadFromGoal(const Neighbours& neighbours, int goal_place, double* distance_m,
                    int* next_place) {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance_m[goal_place] = 0.0;
  queue.push({0.0, goal_place});
  while (!queue.empty()) {
    const auto [way_m, place] = queue.top();
    queue.pop();
    if (way_m > distance_m[place]) continue;
    for (const Neighbour& neighbour : neighbours[place]) {
      const double longer_m = way_m + neighbour.way_m;
      if (longer_m >= distance_m[neighbour.place]) continue;
      distance_m[neighbour.place] = longer_m;
      next_place[neighbour.place] = place;
      queue.push({longer_m, neighbour.place});
    }
  }
}

}  // namespace

GoalField::GoalField(WalkGraph graph, std::vector<Goal> goals)
    : graph_(std::move(graph)), goals_(std::move(goals)) {
  CheckGraph(graph_, goals_);
  const size_t place_count = graph_.places_map.size();
  distance_m_.assign(goals_.size() * place_count, std::numeric_limits<double>::infinity());
  next_place_.assign(goals_.size() * place_count, -1);
  const Neighbours neighbours = ListNeighbours(graph_);
  for (size_t i = 0; i < goals_.size(); ++i) {
    SpreadFromGoal(neighbours, goals_[i].place, distance_m_.data() + i * place_count,
                   next_place_.data() + i * place_count);
  }
}

double GoalField::DistanceM(int goal, int place) const {
  DSG_CHECK(goal >= 0 && static_cast<size_t>(goal) < goals_.size() && IsPlace(place, graph_));
  return distance_m_[static_cast<size_t>(goal) * graph_.places_map.size() + place];
}

int GoalField::NextPlace(int goal, int place) const {
  DSG_CHECK(goal >= 0 && static_cast<size_t>(goal) < goals_.size() && IsPlace(place, graph_));
  return next_place_[static_cast<size_t>(goal) * graph_.places_map.size() + place];
}

}  // namespace dsg::query
