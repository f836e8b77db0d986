// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "ingest/rooms/find_rooms.h"

namespace dsg::ingest {
namespace {

using Tile = std::tuple<int64_t, int64_t>;

Tile TileOf(const Eigen::Vector3d& point, double tile_m) {
  return {static_cast<int64_t>(std::floor(point.x() / tile_m)),
          static_cast<int64_t>(std::floor(point.y() / tile_m))};
}

/// Old places by where they are.
class OldPlaces {
 public:
  explicit OldPlaces(double near_m) : near_m_(near_m) {}

  void Add(const Eigen::Vector3d& point_map, size_t room) {
    tiles_[TileOf(point_map, near_m_)].push_back({point_map, room});
  }

  /// Room of the nearest one that is near enough; -1 = none.
  int RoomNear(const Eigen::Vector3d& point_map) const {
    const auto [x, y] = TileOf(point_map, near_m_);
    double best_m = near_m_;
    int room = -1;
    for (int64_t dx = -1; dx <= 1; ++dx) {
      for (int64_t dy = -1; dy <= 1; ++dy) {
        const auto tile = tiles_.find({x + dx, y + dy});
        if (tile == tiles_.end()) continue;
        for (const Item& item : tile->second) {
          const double distance_m = (item.point_map - point_map).norm();
          if (distance_m >= best_m) continue;
          best_m = distance_m;
          room = static_cast<int>(item.room);
        }
      }
    }
    return room;
  }

 private:
  struct Item {
    Eigen::Vector3d point_map;
    size_t room;
  };
  double near_m_;
  std::map<Tile, std::vector<Item>> tiles_;
};

}  // namespace

void RoomTracker::Track(const std::vector<RoomPlace>& places, std::vector<FoundRoom>* rooms) {
  OldPlaces old_places(same_place_m_);
  for (size_t i = 0; i < last_.size(); ++i) {
    for (const Eigen::Vector3d& point_map : last_[i].places_map) old_places.Add(point_map, i);
  }
  std::map<std::pair<size_t, size_t>, int64_t> shared;
  for (size_t i = 0; i < rooms->size(); ++i) {
    for (const int place : (*rooms)[i].places) {
      const int old = old_places.RoomNear(places[static_cast<size_t>(place)].position_map);
      if (old >= 0) ++shared[{static_cast<size_t>(old), i}];
    }
  }
  // Largest share first; the older room, then the first new one, of equal ones.
  std::vector<std::tuple<int64_t, size_t, size_t>> pairs;
  for (const auto& [pair, count] : shared) pairs.emplace_back(-count, pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
  for (FoundRoom& room : *rooms) room.id = -1;
  std::vector<bool> is_taken(last_.size(), false);
  for (const auto& [negative_count, old, room] : pairs) {
    if (is_taken[old] || (*rooms)[room].id >= 0) continue;
    is_taken[old] = true;
    (*rooms)[room].id = last_[old].id;
  }
  last_.clear();
  for (FoundRoom& room : *rooms) {
    if (room.id < 0) room.id = next_id_++;
    Old old{room.id, {}};
    for (const int place : room.places) {
      old.places_map.push_back(places[static_cast<size_t>(place)].position_map);
    }
    last_.push_back(std::move(old));
  }
  // The older room wins ties, whatever the order of the rooms.
  std::sort(last_.begin(), last_.end(), [](const Old& a, const Old& b) { return a.id < b.id; });
}

void RoomTracker::Move(const PointMove& move) {
  for (Old& room : last_) {
    for (Eigen::Vector3d& place_map : room.places_map) place_map = move(place_map) * place_map;
  }
}

}  // namespace dsg::ingest
