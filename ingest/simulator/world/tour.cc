// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/tour.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

using Matrix = std::vector<std::vector<double>>;

/// Walking distance from a place to each place.
std::vector<double> DistancesFrom(const World& world,
                                  const std::vector<std::vector<int>>& neighbours, int start) {
  const std::vector<Place>& places = world.places.places;
  std::vector<double> distance(places.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  distance[start] = 0.0;
  open.push({0.0, start});
  while (!open.empty()) {
    const auto [reached, current] = open.top();
    open.pop();
    if (reached > distance[current]) continue;
    for (const int next : neighbours[current]) {
      const double through = reached + (places[next].position - places[current].position).norm();
      if (through >= distance[next]) continue;
      distance[next] = through;
      open.push({through, next});
    }
  }
  return distance;
}

Matrix DistancesBetween(const World& world, const std::vector<int>& rooms) {
  const auto neighbours = world.places.Neighbours();
  std::vector<int> centers;
  for (const int room : rooms) centers.push_back(RoomiestPlace(world, room));
  Matrix between;
  for (const int from : centers) {
    const std::vector<double> distance = DistancesFrom(world, neighbours, from);
    between.emplace_back();
    for (const int to : centers) between.back().push_back(distance[to]);
  }
  return between;
}

std::vector<size_t> NearestNeighbourTour(const Matrix& between) {
  std::vector<size_t> tour = {0};
  std::vector<bool> visited(between.size(), false);
  visited[0] = true;
  while (tour.size() < between.size()) {
    size_t nearest = 0;
    for (size_t next = 0; next < between.size(); ++next) {
      if (visited[next]) continue;
      if (visited[nearest] || between[tour.back()][next] < between[tour.back()][nearest]) {
        nearest = next;
      }
    }
    visited[nearest] = true;
    tour.push_back(nearest);
  }
  return tour;
}

/// Turns parts of the round trip around for as long as that makes it shorter (2-opt).
void Uncross(const Matrix& between, std::vector<size_t>* tour) {
  constexpr double kGainMinM = 1e-6;
  const size_t count = tour->size();
  const auto at = [&](size_t i) { return (*tour)[i % count]; };
  bool improved = true;
  while (improved) {
    improved = false;
    for (size_t i = 0; i + 2 < count; ++i) {
      for (size_t j = i + 2; j < count; ++j) {
        const double before = between[at(i)][at(i + 1)] + between[at(j)][at(j + 1)];
        const double after = between[at(i)][at(j)] + between[at(i + 1)][at(j + 1)];
        if (after >= before - kGainMinM) continue;
        std::reverse(tour->begin() + static_cast<ptrdiff_t>(i + 1),
                     tour->begin() + static_cast<ptrdiff_t>(j + 1));
        improved = true;
      }
    }
  }
}

}  // namespace

std::vector<int> RoomsToStay(const World& world) {
  std::vector<int> rooms;
  for (int room = 0; room < static_cast<int>(world.plan.rooms.size()); ++room) {
    if (!world.plan.rooms[room].is_passage) rooms.push_back(room);
  }
  return rooms;
}

int RoomiestPlace(const World& world, int room) {
  int roomiest = -1;
  double clearance = -1.0;
  for (size_t i = 0; i < world.places.places.size(); ++i) {
    const Place& place = world.places.places[i];
    if (place.room != room || place.door >= 0 || place.clearance_m <= clearance) continue;
    clearance = place.clearance_m;
    roomiest = static_cast<int>(i);
  }
  // GenerateWorld refuses worlds with a room that has no place.
  DSG_CHECK(roomiest >= 0);
  return roomiest;
}

std::vector<int> RoomTour(const World& world) {
  const std::vector<int> rooms = RoomsToStay(world);
  const Matrix between = DistancesBetween(world, rooms);
  std::vector<size_t> order = NearestNeighbourTour(between);
  Uncross(between, &order);
  std::vector<int> tour;
  for (const size_t i : order) tour.push_back(rooms[i]);
  return tour;
}

}  // namespace dsg::simulator
