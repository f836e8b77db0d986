// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

Point InDisk(const Point& center, double radius, Random* random) {
  const double angle = random->Uniform(0.0, 2.0 * std::numbers::pi);
  const double distance = radius * std::sqrt(random->Uniform());
  return center + distance * Point(std::cos(angle), std::sin(angle));
}

}  // namespace

Planner::Planner(const World* world) : world_(*world), neighbours_(world->places.Neighbours()) {}

Goal Planner::DrawGoal(int place, Random* random) const {
  const Place& at = world_.places.places[place];
  // Any straight walk within this disk keeps kWalkClearanceM.
  const double radius = std::clamp(at.clearance_m - kWalkClearanceM, 0.0, 0.5);
  return {place, InDisk(at.position, radius, random)};
}

std::vector<int> Planner::ShortestRoute(int from, int to) const {
  const std::vector<Place>& places = world_.places.places;
  std::vector<double> cost(places.size(), std::numeric_limits<double>::infinity());
  std::vector<int> parent(places.size(), -1);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto ahead = [&](int i) { return (places[i].position - places[to].position).norm(); };
  cost[from] = 0.0;
  open.push({ahead(from), from});
  while (!open.empty()) {
    const auto [estimate, current] = open.top();
    open.pop();
    if (current == to) break;
    if (estimate > cost[current] + ahead(current) + 1e-9) continue;
    for (const int next : neighbours_[current]) {
      const double length = (places[next].position - places[current].position).norm();
      if (cost[current] + length >= cost[next]) continue;
      cost[next] = cost[current] + length;
      parent[next] = current;
      open.push({cost[next] + ahead(next), next});
    }
  }
  std::vector<int> route = {to};
  while (route.back() != from) {
    // GenerateWorld refuses worlds whose places are not all connected.
    DSG_CHECK(parent[route.back()] >= 0);
    route.push_back(parent[route.back()]);
  }
  std::reverse(route.begin(), route.end());
  return route;
}

std::vector<Point> Planner::Shorten(const std::vector<Point>& route) const {
  std::vector<Point> out = {route.front()};
  for (size_t i = 0; i + 1 < route.size();) {
    size_t j = i + 1;
    while (j + 1 < route.size() &&
           world_.free_space.SegmentKeepsClear(route[i], route[j + 1], kWalkClearanceM)) {
      ++j;
    }
    out.push_back(route[j]);
    i = j;
  }
  return out;
}

Path Planner::Plan(const Goal& from, const Goal& to, Random* random) const {
  std::vector<Point> route = {from.position};
  for (const int place : ShortestRoute(from.place, to.place)) {
    route.push_back(world_.places.places[place].position);
  }
  route.push_back(to.position);
  route = Shorten(route);
  // Nobody walks the same line twice: move each turn a little where both legs stay clear.
  for (size_t i = 1; i + 1 < route.size(); ++i) {
    const double room = world_.free_space.Clearance(route[i]) - kWalkClearanceM;
    const Point moved = InDisk(route[i], std::clamp(room, 0.0, 0.4), random);
    if (world_.free_space.SegmentKeepsClear(route[i - 1], moved, kWalkClearanceM) &&
        world_.free_space.SegmentKeepsClear(moved, route[i + 1], kWalkClearanceM)) {
      route[i] = moved;
    }
  }
  return Path(route);
}

}  // namespace dsg::simulator
