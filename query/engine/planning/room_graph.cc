// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/room_graph.h"

#include <algorithm>
#include <tuple>

namespace dsg::query {

RoomGraph::RoomGraph(const PlaceGraph& graph) {
  std::vector<NodeId> rooms;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    if (rooms.empty() || rooms.back() != graph.room(place)) rooms.push_back(graph.room(place));
  }
  std::sort(rooms.begin(), rooms.end());
  rooms.erase(std::unique(rooms.begin(), rooms.end()), rooms.end());
  room_of_.reserve(static_cast<size_t>(graph.size()));
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    const auto found = std::lower_bound(rooms.begin(), rooms.end(), graph.room(place));
    room_of_.push_back(static_cast<int32_t>(found - rooms.begin()));
  }

  struct Found {
    int32_t from;
    int32_t to;
    Crossing crossing;
  };
  std::vector<Found> found;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    uint32_t number = 0;
    for (const auto* link = graph.links_begin(place); link != graph.links_end(place); ++link) {
      const int32_t to = room_of(link->to);
      if (to != room_of(place)) found.push_back({room_of(place), to, {place, number}});
      ++number;
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  });
  first_door_.assign(rooms.size() + 1, 0);
  for (size_t i = 0; i < found.size(); ++i) {
    crossings_.push_back(found[i].crossing);
    const uint32_t end = static_cast<uint32_t>(i + 1);
    if (i > 0 && found[i].from == found[i - 1].from && found[i].to == found[i - 1].to) {
      doors_.back().end = end;
      continue;
    }
    doors_.push_back({found[i].to, end - 1, end});
    ++first_door_[static_cast<size_t>(found[i].from) + 1];
  }
  for (size_t i = 1; i < first_door_.size(); ++i) first_door_[i] += first_door_[i - 1];
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
