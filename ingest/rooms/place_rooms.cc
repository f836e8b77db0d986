// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/place_rooms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace dsg::ingest {
namespace {

bool IsLink(const RoomLink& link, size_t place_count) {
  return link.from >= 0 && link.to >= 0 && static_cast<size_t>(link.from) < place_count &&
         static_cast<size_t>(link.to) < place_count && link.from != link.to;
}

struct Neighbour {
  int place = 0;
  double clearance_m = 0.0;
};

std::vector<std::vector<Neighbour>> NeighboursOf(const std::vector<RoomLink>& links,
                                                 size_t place_count) {
  std::vector<std::vector<Neighbour>> neighbours(place_count);
  for (const RoomLink& link : links) {
    if (!IsLink(link, place_count)) continue;
    neighbours[static_cast<size_t>(link.from)].push_back({link.to, link.clearance_m});
    neighbours[static_cast<size_t>(link.to)].push_back({link.from, link.clearance_m});
  }
  return neighbours;
}

int MajorityOf(const std::vector<Neighbour>& neighbours, const std::vector<int>& rooms) {
  struct Votes {
    int count = 0;
    double widest_m = 0.0;
  };
  std::map<int, Votes> votes;
  for (const Neighbour& neighbour : neighbours) {
    const int room = rooms[static_cast<size_t>(neighbour.place)];
    if (room < 0) continue;
    Votes& vote = votes[room];
    ++vote.count;
    vote.widest_m = std::max(vote.widest_m, neighbour.clearance_m);
  }
  int best = -1;
  Votes most;
  for (const auto& [room, vote] : votes) {
    const bool is_more =
        vote.count > most.count || (vote.count == most.count && vote.widest_m > most.widest_m);
    if (best >= 0 && !is_more) continue;
    best = room;
    most = vote;
  }
  return best;
}

std::pair<int, int> Ordered(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

std::vector<int> RoomsOfPlaces(const std::vector<RoomPlace>& places,
                               const std::vector<RoomLink>& links, const PlanRegions& regions) {
  std::vector<int> rooms;
  rooms.reserve(places.size());
  for (const RoomPlace& place : places) {
    rooms.push_back(regions.At(place.position_map.head<2>()));
  }
  const auto neighbours = NeighboursOf(links, places.size());
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<int> next = rooms;
    for (size_t i = 0; i < rooms.size(); ++i) {
      if (rooms[i] >= 0) continue;
      next[i] = MajorityOf(neighbours[i], rooms);
      changed |= next[i] >= 0;
    }
    rooms.swap(next);
  }
  return rooms;
}

std::vector<std::pair<int, int>> AdjacentRooms(const std::vector<RoomPlace>& places,
                                               const std::vector<RoomLink>& links,
                                               const std::vector<int>& room_of_place,
                                               const PlanRegions& regions) {
  std::set<std::pair<int, int>> pairs;
  for (const RoomLink& link : links) {
    if (!IsLink(link, places.size())) continue;
    const auto from = static_cast<size_t>(link.from);
    const auto to = static_cast<size_t>(link.to);
    if (room_of_place[from] == room_of_place[to]) continue;
    int last = room_of_place[from];
    const auto enter = [&](int room) {
      if (room < 0 || room == last) return;
      if (last >= 0) pairs.insert(Ordered(last, room));
      last = room;
    };
    const Eigen::Vector2d begin = places[from].position_map.head<2>();
    const Eigen::Vector2d way = places[to].position_map.head<2>() - begin;
    const int steps = static_cast<int>(std::ceil(way.norm() / (0.5 * regions.frame.cell_m)));
    for (int step = 1; step < steps; ++step) {
      enter(regions.At(begin + way * (static_cast<double>(step) / steps)));
    }
    enter(room_of_place[to]);
  }
  return {pairs.begin(), pairs.end()};
}

std::vector<std::pair<int, int>> LinkedRooms(const std::vector<RoomLink>& links,
                                             const std::vector<int>& room_of_place) {
  std::set<std::pair<int, int>> pairs;
  for (const RoomLink& link : links) {
    if (!IsLink(link, room_of_place.size())) continue;
    const int from = room_of_place[static_cast<size_t>(link.from)];
    const int to = room_of_place[static_cast<size_t>(link.to)];
    if (from >= 0 && to >= 0 && from != to) pairs.insert(Ordered(from, to));
  }
  return {pairs.begin(), pairs.end()};
}

double Disagreement(const std::vector<int>& a, const std::vector<int>& b) {
  if (a.empty()) return 0.0;
  std::map<std::pair<int, int>, int64_t> shared;
  for (size_t i = 0; i < a.size(); ++i) ++shared[{a[i], b[i]}];
  std::map<int, std::pair<int64_t, int>> best_of_a;
  std::map<int, std::pair<int64_t, int>> best_of_b;
  for (const auto& [rooms, count] : shared) {
    best_of_a[rooms.first] = std::max(best_of_a[rooms.first], {count, rooms.second});
    best_of_b[rooms.second] = std::max(best_of_b[rooms.second], {count, rooms.first});
  }
  int64_t same = 0;
  for (const auto& [rooms, count] : shared) {
    const bool is_mutual = best_of_a[rooms.first].second == rooms.second &&
                           best_of_b[rooms.second].second == rooms.first;
    if (is_mutual) same += count;
  }
  return 1.0 - static_cast<double>(same) / static_cast<double>(a.size());
}

}  // namespace dsg::ingest
