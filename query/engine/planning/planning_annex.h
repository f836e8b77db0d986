// SPDX-License-Identifier: Apache-2.0
// What planning derives from a graph of places once and keeps beside it: which places are near, how
// rooms lead to each other, and landmarks. It saves time and changes no answer.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/ends.h"
#include "query/engine/planning/landmarks.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// The places near a box, by cubic cells; unsorted.
///
/// Threads: immutable.
class PlaceLocator {
 public:
  /// Errors: what `stop` returned.
  static absl::StatusOr<PlaceLocator> Build(const PlaceGraph& graph, const StopCheck& stop);

  /// All places no further than `reach_m` from the box, and some that are. In no useful order.
  void ForEachNear(const Box3d& box_map, double reach_m,
                   const std::function<void(PlaceIndex)>& visit) const;

  /// Of all places, and the longest of all links; metres.
  double clearance_m_max() const { return clearance_m_max_; }
  double link_length_m_max() const { return link_length_m_max_; }

  size_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    uint64_t cell = 0;
    PlaceIndex place = 0;
  };

  PlaceLocator() = default;

  // Ascending cell, then place.
  std::vector<Entry> entries_;
  double clearance_m_max_ = 0.0;
  double link_length_m_max_ = 0.0;
};

/// The rooms and the links between them: the level above the places. Knows no lengths.
///
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

/// What planning keeps of one graph of places.
///
/// Threads: safe from many threads.
class PlanningAnnex final : public PlaceGraph::Annex {
 public:
  PlanningAnnex(RoomGraph rooms, PlaceLocator locator)
      : rooms_(std::move(rooms)), locator_(std::move(locator)) {}

  /// Of this graph, made at the first call; lives as long as the graph.
  /// Errors: what `stop` returned.
  static absl::StatusOr<PlanningAnnex*> Of(const PlaceGraph& graph, const StopCheck& stop);

  const RoomGraph& rooms() const { return rooms_; }
  const PlaceLocator& locator() const { return locator_; }
  LandmarkCache& landmarks() { return landmarks_; }

  size_t memory_bytes() const override {
    return rooms_.memory_bytes() + locator_.memory_bytes() + landmarks_.memory_bytes();
  }

 private:
  RoomGraph rooms_;
  PlaceLocator locator_;
  LandmarkCache landmarks_;
};

}  // namespace dsg::query
