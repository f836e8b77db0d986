// SPDX-License-Identifier: Apache-2.0
// The rooms and the links that lead from one to another: the level above the places.
// Refuses to tell how far it is; that is the places' to say.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/anchor.h"
#include "query/engine/planning/limits.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Places of no room count as one room, since nobody knows better.
///
/// Threads: immutable.
class RoomGraph {
 public:
  /// Errors: what `stop` returned.
  static absl::StatusOr<RoomGraph> Build(const PlaceGraph& graph, const StopCheck& stop);

  int32_t room_of(PlaceIndex place) const { return room_of_[static_cast<size_t>(place)]; }
  int32_t room_count() const { return static_cast<int32_t>(first_door_.size()) - 1; }

  /// One entry a room, 1 = from there a way may lead to one of the goals, 0 = none does: each step
  /// from room to room has a link that the limits admit. Says nothing of the ways within a room.
  std::vector<uint8_t> LeadingTo(const PlaceGraph& graph, const std::vector<Anchor>& goals,
                                 const Limits& limits) const;

  size_t memory_bytes() const;

 private:
  // A link that leaves a room.
  struct Crossing {
    PlaceIndex place = 0;
    // Counted from links_begin(place).
    uint32_t link = 0;
  };
  // Crossings [begin, end) lead from the room that has the door to `to`.
  struct Door {
    int32_t to = 0;
    uint32_t begin = 0;
    uint32_t end = 0;
  };

  // From one room to another.
  struct FoundCrossing {
    int32_t from = 0;
    int32_t to = 0;
    Crossing crossing;
  };

  RoomGraph() = default;

  absl::Status FindRooms(const PlaceGraph& graph, const StopCheck& stop);
  absl::StatusOr<std::vector<FoundCrossing>> FindCrossings(const PlaceGraph& graph,
                                                           const StopCheck& stop) const;
  bool IsOpen(const PlaceGraph& graph, const Door& door, const Limits& limits) const;

  std::vector<int32_t> room_of_;
  std::vector<Crossing> crossings_;
  std::vector<Door> doors_;
  // Of each room, and the end of all.
  std::vector<uint32_t> first_door_;
};

}  // namespace dsg::query
