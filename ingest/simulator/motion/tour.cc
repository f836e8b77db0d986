// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/tour.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

// What one sees well from its middle.
constexpr double kAreaM = 9.0;
constexpr double kPassageAreaM = 16.0;
// A stop stands clear of furniture, for a view, and out of the way of the door.
struct StopNeeds {
  double clearance_m;
  double door_m;
};
constexpr StopNeeds kStopNeeds[] = {{0.6, 1.0}, {0.45, 0.0}, {0.0, 0.0}};
constexpr double kStartClearanceM = 0.45;
constexpr double kStartDoorM = 2.5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Area {
  int room = 0;
  bool is_passage = false;
  Point middle = Point::Zero();
  /// Places to stop at.
  std::vector<int> places;
};

std::vector<Area> AreasOf(const Room& room, int index, std::vector<Rect>* rects) {
  const Rect floor = room.Interior();
  const double edge = room.is_passage ? kPassageAreaM : kAreaM;
  const Eigen::Vector2i counts = (floor.sizes() / edge).array().ceil().cast<int>().max(1);
  const Point size = floor.sizes().cwiseQuotient(counts.cast<double>());
  std::vector<Area> areas;
  for (int row = 0; row < counts.y(); ++row) {
    for (int column = 0; column < counts.x(); ++column) {
      const Point low = floor.min() + size.cwiseProduct(Point(column, row));
      rects->push_back(Rect(low, low + size));
      areas.push_back({index, room.is_passage, rects->back().center(), {}});
    }
  }
  return areas;
}

// Of the doors of the place's room, that to `other` only, or any if it is -1.
double DistanceToDoor(const World& world, const Place& place, int other = -1) {
  double nearest = kInfinity;
  for (const Door& door : world.plan.doors) {
    if (!door.Joins(place.room) || (other >= 0 && !door.Joins(other))) continue;
    nearest = std::min(nearest, (door.center - place.position).norm());
  }
  return nearest;
}

bool IsStop(const World& world, const Place& place, const StopNeeds& needs) {
  if (place.door >= 0 || place.clearance_m < needs.clearance_m) return false;
  // In a corridor doors are everywhere.
  return world.plan.rooms[place.room].is_passage || DistanceToDoor(world, place) >= needs.door_m;
}

std::vector<Area> FindAreas(const World& world) {
  std::vector<Area> areas;
  std::vector<Rect> rects;
  for (int room = 0; room < static_cast<int>(world.plan.rooms.size()); ++room) {
    for (Area& area : AreasOf(world.plan.rooms[room], room, &rects)) {
      areas.push_back(std::move(area));
    }
  }
  const std::vector<Place>& places = world.places.places;
  // Where a room is so full that no place has what is needed, take what there is.
  for (const StopNeeds& needs : kStopNeeds) {
    for (size_t i = 0; i < areas.size(); ++i) {
      if (!areas[i].places.empty()) continue;
      for (int k = 0; k < static_cast<int>(places.size()); ++k) {
        if (places[k].room != areas[i].room || !rects[i].contains(places[k].position)) continue;
        if (IsStop(world, places[k], needs)) areas[i].places.push_back(k);
      }
    }
  }
  std::erase_if(areas, [](const Area& area) { return area.places.empty(); });
  return areas;
}

int DrawStart(const World& world, int first_room, Random* random) {
  const std::vector<Place>& places = world.places.places;
  std::vector<int> candidates;
  for (int i = 0; i < static_cast<int>(places.size()); ++i) {
    if (places[i].door >= 0 || places[i].clearance_m < kStartClearanceM) continue;
    if (!world.plan.rooms[places[i].room].is_passage) continue;
    if (DistanceToDoor(world, places[i], first_room) < kStartDoorM) candidates.push_back(i);
  }
  if (candidates.empty() && first_room >= 0) return DrawStart(world, -1, random);
  if (candidates.empty()) return random->Index(static_cast<int>(places.size()));
  return candidates[random->Index(static_cast<int>(candidates.size()))];
}

// Walked distance from one place to all, by Dijkstra.
std::vector<double> DistancesFrom(int start, const std::vector<Place>& places,
                                  const std::vector<std::vector<int>>& neighbours) {
  std::vector<double> distances(places.size(), kInfinity);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  distances[start] = 0.0;
  open.push({0.0, start});
  while (!open.empty()) {
    const auto [distance, current] = open.top();
    open.pop();
    if (distance > distances[current]) continue;
    for (const int next : neighbours[current]) {
      const double to_next = distance + (places[next].position - places[current].position).norm();
      if (to_next >= distances[next]) continue;
      distances[next] = to_next;
      open.push({to_next, next});
    }
  }
  return distances;
}

struct Choice {
  size_t area = 0;
  int place = -1;
  double cost = kInfinity;
};

Choice Nearest(const std::vector<Area>& areas, const std::vector<Place>& places,
               const std::vector<double>& distances, double center_pull) {
  Choice best;
  for (size_t i = 0; i < areas.size(); ++i) {
    const double pull = areas[i].is_passage ? 0.0 : center_pull;
    for (const int place : areas[i].places) {
      const double aside = (places[place].position - areas[i].middle).norm();
      const double cost = distances[place] + pull * aside;
      if (cost < best.cost) best = {i, place, cost};
    }
  }
  return best;
}

}  // namespace

Tour::Tour(const World& world, const TourOptions& options, Random* random) {
  const std::vector<Place>& places = world.places.places;
  DSG_CHECK(!places.empty());
  const std::vector<std::vector<int>> neighbours = world.places.Neighbours();
  places_ = {DrawStart(world, options.first_room, random)};
  std::vector<Area> areas = FindAreas(world);
  // The start sees its own area.
  std::erase_if(areas, [&](const Area& area) {
    return std::count(area.places.begin(), area.places.end(), places_.front()) > 0;
  });
  while (!areas.empty()) {
    const std::vector<double> distances = DistancesFrom(places_.back(), places, neighbours);
    const Choice next = Nearest(areas, places, distances, options.center_pull);
    if (next.place < 0) break;
    places_.push_back(next.place);
    areas.erase(areas.begin() + static_cast<ptrdiff_t>(next.area));
  }
}

int Tour::StopAt(size_t index) const {
  // Forwards 0 1 .. n-1, then 0 again and backwards n-1 .. 1.
  const size_t count = places_.size();
  const size_t step = index % (2 * count);
  if (step < count) return places_[step];
  return step == count ? places_.front() : places_[2 * count - step];
}

}  // namespace dsg::simulator
