// SPDX-License-Identifier: Apache-2.0
// In which room and nearest to which place a position is, with hysteresis at the walls.
// Refuses to know about time or agents; it is a pure function of where one was and where one is.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/presence/place_grid.h"
#include "schema/model/node.h"

namespace dsg::ingest {

/// A room and a place, as numbers of a RegionIndex; -1 = none.
struct RegionState {
  int32_t room = -1;
  int32_t place = -1;
  bool operator==(const RegionState&) const = default;
};

struct RegionOptions {
  /// A room is left, or a place changed for another, only when that is clear by so much.
  double hysteresis_m = 0.3;
  /// Further away, a place in sight is no better than one that is not.
  double sight_m = 5.0;

  std::vector<BoundOption> Bind();
};

/// Rooms and places of one map.
///
/// Threads: safe from many threads.
class RegionIndex {
 public:
  struct Containment {
    NodeId room;
    NodeId place;
  };

  /// Whether nothing stands between a point and a place.
  using Sight =
      std::function<bool(const Eigen::Vector3d& point_map, const Eigen::Vector3d& place_map)>;

  RegionIndex() = default;
  /// Rooms with neither outline nor box hold nobody. `contains`: which places are in which room;
  /// pairs of unknown nodes are ignored.
  RegionIndex(std::vector<Node> rooms, std::vector<Node> places,
              const std::vector<Containment>& contains, const RegionOptions& options = {});

  bool empty() const { return rooms_.empty() && places_.empty(); }

  /// Where an agent that was in `before` is, now that it stands at `position_map`.
  ///
  /// Room: kept until it is more than hysteresis_m behind, or another is deeper by more than
  /// that and more than that deep; a new one is the deepest that holds the position.
  /// Place: the nearest in sight, within some metres, of the room's places (of all, where there is
  /// no room or it has none); the nearest of any where none is in sight. Kept until another is
  /// nearer by more than hysteresis_m, or it is out of sight and another is not. Ties go to the
  /// lower id. Source: RSS 2020, section IV-B, with line of sight added.
  RegionState Next(RegionState before, const Eigen::Vector3d& position_map) const;

  /// Empty = everything is in sight, as where nothing is known of obstacles.
  void SetSight(Sight sight) { sight_ = std::move(sight); }

  /// The numbers of a room and a place; -1 for ids that are unknown here.
  RegionState Find(NodeId room, NodeId place) const;

  /// Whether the place is in another room than the state says.
  bool IsTorn(RegionState state) const {
    return state.room >= 0 && state.place >= 0 && places_[state.place].room >= 0 &&
           places_[state.place].room != state.room;
  }

  /// Empty for -1.
  NodeId RoomId(int32_t room) const { return room < 0 ? NodeId() : rooms_[room].id; }
  NodeId PlaceId(int32_t place) const { return place < 0 ? NodeId() : places_[place].id; }

 private:
  struct Room {
    NodeId id;
    Polygon2d outline;
    Eigen::AlignedBox2d bounds;
    double z_min_m = 0.0;
    double z_max_m = 0.0;
    /// Places in the room.
    PlaceGrid grid;
  };
  struct Place {
    NodeId id;
    Eigen::Vector3d position;
    /// -1: in no room.
    int32_t room = -1;
  };
  struct Depth {
    /// To the outline and to floor or ceiling, whichever is worse; negative inside.
    double distance_m = 0.0;
    bool holds = false;
  };

  bool MakeRoom(const Node& node, Room* room) const;
  Depth DepthIn(const Room& room, const Eigen::Vector3d& position) const;
  int32_t NextRoom(int32_t before, const Eigen::Vector3d& position) const;
  bool IsInSight(const Eigen::Vector3d& position, int32_t place) const;
  int32_t NextPlace(int32_t room, int32_t before, const Eigen::Vector3d& position) const;

  /// Ascending by id, so that a lower number is a lower id.
  std::vector<Room> rooms_;
  std::vector<Place> places_;
  PlaceGrid all_places_;
  Sight sight_;
  RegionOptions options_;
};

}  // namespace dsg::ingest
