// SPDX-License-Identifier: Apache-2.0
#include "ingest/presence/region_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dsg::ingest {
namespace {

constexpr OptionField<RegionOptions> kRegionFields[] = {
    {"stay-hysteresis", &RegionOptions::hysteresis_m, 0.0, 10.0,
     "A room is left, or a place changed for another, only when that is clear by so much, metres: "
     "noise of poses at a wall must not end stays"},
    {"stay-sight", &RegionOptions::sight_m, 0.0, 1000.0,
     "Farther away, a place in sight is no better than one that is not, metres: places lie denser"},
};

void SortById(std::vector<Node>* nodes) {
  std::sort(nodes->begin(), nodes->end(), [](const Node& a, const Node& b) { return a.id < b.id; });
}

}  // namespace

std::vector<BoundOption> RegionOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<RegionOptions>(kRegionFields, this, &bound);
  return bound;
}

RegionIndex::RegionIndex(std::vector<Node> rooms, std::vector<Node> places,
                         const std::vector<Containment>& contains, const RegionOptions& options)
    : options_(options) {
  SortById(&rooms);
  SortById(&places);
  std::unordered_map<NodeId, int32_t> number_of_room;
  for (const Node& node : rooms) {
    Room room;
    if (!MakeRoom(node, &room)) continue;
    number_of_room[node.id] = static_cast<int32_t>(rooms_.size());
    rooms_.push_back(std::move(room));
  }
  std::unordered_map<NodeId, int32_t> number_of_place;
  for (const Node& node : places) {
    number_of_place[node.id] = static_cast<int32_t>(places_.size());
    places_.push_back({node.id, node.map_T_node.position, -1});
  }
  std::vector<std::vector<PlaceGrid::Item>> items_of_room(rooms_.size());
  for (const Containment& pair : contains) {
    const auto room = number_of_room.find(pair.room);
    const auto place = number_of_place.find(pair.place);
    if (room == number_of_room.end() || place == number_of_place.end()) continue;
    Place& inside = places_[place->second];
    // A place has one room; should a map say more, the first holds.
    if (inside.room >= 0) continue;
    inside.room = room->second;
    items_of_room[room->second].push_back({place->second, inside.position});
  }
  for (size_t i = 0; i < rooms_.size(); ++i) rooms_[i].grid = PlaceGrid(items_of_room[i]);
  std::vector<PlaceGrid::Item> all;
  for (size_t i = 0; i < places_.size(); ++i) {
    all.push_back({static_cast<int32_t>(i), places_[i].position});
  }
  all_places_ = PlaceGrid(std::move(all));
}

bool RegionIndex::MakeRoom(const Node& node, Room* room) const {
  room->id = node.id;
  const Box3d box = node.box_node.isEmpty() ? Box3d() : node.BoxMap();
  room->z_min_m = -std::numeric_limits<double>::infinity();
  room->z_max_m = std::numeric_limits<double>::infinity();
  if (!box.isEmpty()) {
    room->z_min_m = box.min().z();
    room->z_max_m = box.max().z();
  }
  if (node.region.has_value() && node.region->footprint_map.size() >= 3) {
    room->outline = node.region->footprint_map;
    if (node.region->z_min_m < node.region->z_max_m) {
      room->z_min_m = node.region->z_min_m;
      room->z_max_m = node.region->z_max_m;
    }
  } else if (!box.isEmpty()) {
    room->outline = {{box.min().x(), box.min().y()},
                     {box.max().x(), box.min().y()},
                     {box.max().x(), box.max().y()},
                     {box.min().x(), box.max().y()}};
  }
  for (const Eigen::Vector2d& corner : room->outline) room->bounds.extend(corner);
  return !room->outline.empty();
}

RegionIndex::Depth RegionIndex::DepthIn(const Room& room, const Eigen::Vector3d& position) const {
  const double across = SignedDistanceToPolygon(room.outline, position.head<2>());
  const double z = position.z();
  // The sign, not the value: a point on the outline is inside at -0.0.
  const bool is_within = std::signbit(across);
  // Half-open, so that a floor belongs to the storey above it.
  if (room.z_min_m <= z && z < room.z_max_m) return {across, is_within};
  const double beyond = z < room.z_min_m ? room.z_min_m - z : z - room.z_max_m;
  // Feet measured just below the floor are still in the room.
  return {std::max(across, beyond), is_within && beyond <= options_.hysteresis_m};
}

int32_t RegionIndex::NextRoom(int32_t before, const Eigen::Vector3d& position) const {
  double own_m = std::numeric_limits<double>::infinity();
  if (before >= 0) own_m = DepthIn(rooms_[before], position).distance_m;
  int32_t deepest = -1;
  double deepest_m = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < rooms_.size(); ++i) {
    if (!rooms_[i].bounds.contains(position.head<2>())) continue;
    const Depth depth = DepthIn(rooms_[i], position);
    if (depth.holds && depth.distance_m < deepest_m) {
      deepest = static_cast<int32_t>(i);
      deepest_m = depth.distance_m;
    }
  }
  if (own_m > options_.hysteresis_m) return deepest;
  // Where rooms overlap, being deep in both must not change the room with every pose.
  const bool is_other_clear =
      deepest_m < -options_.hysteresis_m && deepest_m < own_m - options_.hysteresis_m;
  return is_other_clear ? deepest : before;
}

bool RegionIndex::IsInSight(const Eigen::Vector3d& position, int32_t place) const {
  return !sight_ || sight_(position, places_[place].position);
}

int32_t RegionIndex::NextPlace(int32_t room, int32_t before,
                               const Eigen::Vector3d& position) const {
  if (places_.empty()) return -1;
  const bool is_within_room = room >= 0 && !rooms_[room].grid.empty();
  const PlaceGrid& grid = is_within_room ? rooms_[room].grid : all_places_;
  PlaceGrid::Found nearest;
  if (sight_) {
    nearest = grid.Nearest(
        position, [&](int32_t place) { return IsInSight(position, place); }, options_.sight_m);
  }
  const bool is_in_sight = nearest.number >= 0;
  if (!is_in_sight) nearest = grid.Nearest(position);
  if (before < 0 || (is_within_room && places_[before].room != room)) return nearest.number;
  if (is_in_sight && !IsInSight(position, before)) return nearest.number;
  const double own_m = (places_[before].position - position).norm();
  return nearest.distance_m < own_m - options_.hysteresis_m ? nearest.number : before;
}

RegionState RegionIndex::Next(RegionState before, const Eigen::Vector3d& position_map) const {
  RegionState next;
  next.room = NextRoom(before.room, position_map);
  next.place = NextPlace(next.room, before.place, position_map);
  return next;
}

RegionState RegionIndex::Find(NodeId room, NodeId place) const {
  const auto number_of = [](const auto& regions, NodeId id) {
    const auto found =
        std::lower_bound(regions.begin(), regions.end(), id,
                         [](const auto& region, NodeId wanted) { return region.id < wanted; });
    const bool is_there = found != regions.end() && found->id == id;
    return is_there ? static_cast<int32_t>(found - regions.begin()) : -1;
  };
  return {number_of(rooms_, room), number_of(places_, place)};
}

}  // namespace dsg::ingest
