// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/room_graph.h"

#include <algorithm>
#include <functional>
#include <tuple>

#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Places between two questions to the stop check.
constexpr int64_t kStopPeriod = 1024;

}  // namespace

absl::StatusOr<RoomGraph> RoomGraph::Build(const PlaceGraph& graph, const StopCheck& stop) {
  RoomGraph made;
  DSG_RETURN_IF_ERROR(made.FindRooms(graph, stop));
  DSG_ASSIGN_OR_RETURN(const std::vector<FoundCrossing> found, made.FindCrossings(graph, stop));
  for (size_t i = 0; i < found.size(); ++i) {
    made.crossings_.push_back(found[i].crossing);
    const uint32_t end = static_cast<uint32_t>(i + 1);
    if (i > 0 && found[i].from == found[i - 1].from && found[i].to == found[i - 1].to) {
      made.doors_.back().end = end;
      continue;
    }
    made.doors_.push_back({found[i].to, end - 1, end});
    ++made.first_door_[static_cast<size_t>(found[i].from) + 1];
  }
  for (size_t i = 1; i < made.first_door_.size(); ++i) {
    made.first_door_[i] += made.first_door_[i - 1];
  }
  return made;
}

absl::Status RoomGraph::FindRooms(const PlaceGraph& graph, const StopCheck& stop) {
  StopCounter counter(stop, kStopPeriod);
  std::vector<NodeId> rooms;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    if (rooms.empty() || rooms.back() != graph.room(place)) rooms.push_back(graph.room(place));
  }
  DSG_RETURN_IF_ERROR(SortStoppably(std::less<>(), stop, &rooms));
  rooms.erase(std::unique(rooms.begin(), rooms.end()), rooms.end());
  room_of_.reserve(static_cast<size_t>(graph.size()));
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const auto found = std::lower_bound(rooms.begin(), rooms.end(), graph.room(place));
    room_of_.push_back(static_cast<int32_t>(found - rooms.begin()));
  }
  first_door_.assign(rooms.size() + 1, 0);
  return absl::OkStatus();
}

// Ascending by both rooms, then place and link.
absl::StatusOr<std::vector<RoomGraph::FoundCrossing>> RoomGraph::FindCrossings(
    const PlaceGraph& graph, const StopCheck& stop) const {
  StopCounter counter(stop, kStopPeriod);
  std::vector<FoundCrossing> found;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    uint32_t number = 0;
    for (const auto* link = graph.links_begin(place); link != graph.links_end(place); ++link) {
      const int32_t to = room_of(link->to);
      if (to != room_of(place)) found.push_back({room_of(place), to, {place, number}});
      ++number;
    }
  }
  const auto less = [](const FoundCrossing& a, const FoundCrossing& b) {
    return std::tie(a.from, a.to, a.crossing.place, a.crossing.link) <
           std::tie(b.from, b.to, b.crossing.place, b.crossing.link);
  };
  DSG_RETURN_IF_ERROR(SortStoppably(less, stop, &found));
  return found;
}

bool RoomGraph::IsOpen(const PlaceGraph& graph, const Door& door, const Limits& limits) const {
  return std::any_of(crossings_.begin() + door.begin, crossings_.begin() + door.end,
                     [&](const Crossing& crossing) {
                       const auto& link = graph.links_begin(crossing.place)[crossing.link];
                       return limits.Admits(link) && limits.Admits(graph, crossing.place) &&
                              limits.Admits(graph, link.to);
                     });
}

std::vector<uint8_t> RoomGraph::LeadingTo(const PlaceGraph& graph, const std::vector<Anchor>& goals,
                                          const Limits& limits) const {
  std::vector<uint8_t> leading(static_cast<size_t>(room_count()), 0);
  std::vector<int32_t> pending;
  const auto add = [&](int32_t room) {
    uint8_t& mark = leading[static_cast<size_t>(room)];
    if (mark != 0) return;
    mark = 1;
    pending.push_back(room);
  };
  for (const Anchor& goal : goals) add(room_of(goal.place));
  while (!pending.empty()) {
    const size_t room = static_cast<size_t>(pending.back());
    pending.pop_back();
    // Links count in both directions, so what leads out of a room also leads into it.
    for (uint32_t i = first_door_[room]; i < first_door_[room + 1]; ++i) {
      const Door& door = doors_[i];
      if (leading[static_cast<size_t>(door.to)] == 0 && IsOpen(graph, door, limits)) add(door.to);
    }
  }
  return leading;
}

size_t RoomGraph::memory_bytes() const {
  return room_of_.capacity() * sizeof(int32_t) + crossings_.capacity() * sizeof(Crossing) +
         doors_.capacity() * sizeof(Door) + first_door_.capacity() * sizeof(uint32_t);
}

}  // namespace dsg::query
