// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/planning_annex.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <tuple>

#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kCellM = 2.0;
constexpr int64_t kCellMax = (int64_t{1} << 20) - 1;

// What lies beyond 2000 km from the origin shares the outermost cells.
int64_t CellOf(double metres) {
  const double cell = std::floor(metres / kCellM);
  return static_cast<int64_t>(
      std::clamp(cell, -static_cast<double>(kCellMax), static_cast<double>(kCellMax)));
}

uint64_t Pack(int64_t x, int64_t y, int64_t z) {
  const auto bits = [](int64_t cell) { return static_cast<uint64_t>(cell + kCellMax); };
  return bits(x) << 42 | bits(y) << 21 | bits(z);
}

}  // namespace

absl::StatusOr<PlaceLocator> PlaceLocator::Build(const PlaceGraph& graph, const StopCheck& stop) {
  PlaceLocator made;
  made.entries_.reserve(static_cast<size_t>(graph.size()));
  StopCounter counter(stop, kPlacesPerStop);
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const Eigen::Vector3d& at = graph.position_map(place);
    made.entries_.push_back({Pack(CellOf(at.x()), CellOf(at.y()), CellOf(at.z())), place});
    made.clearance_m_max_ = std::max(made.clearance_m_max_, graph.clearance_m(place));
    for (const auto* link = graph.links_begin(place); link != graph.links_end(place); ++link) {
      made.link_length_m_max_ = std::max(made.link_length_m_max_, link->length_m);
    }
  }
  const auto less = [](const Entry& a, const Entry& b) {
    return std::tie(a.cell, a.place) < std::tie(b.cell, b.place);
  };
  DSG_RETURN_IF_ERROR(SortStoppably(less, stop, &made.entries_));
  return made;
}

void PlaceLocator::ForEachNear(const Box3d& box_map, double reach_m,
                               const std::function<void(PlaceIndex)>& visit) const {
  const Eigen::Vector3d low = box_map.min().array() - reach_m;
  const Eigen::Vector3d high = box_map.max().array() + reach_m;
  const int64_t x_end = CellOf(high.x());
  const int64_t y_end = CellOf(high.y());
  const double column_count = static_cast<double>(x_end - CellOf(low.x()) + 1) *
                              static_cast<double>(y_end - CellOf(low.y()) + 1);
  if (column_count > static_cast<double>(entries_.size())) {
    for (const Entry& entry : entries_) visit(entry.place);
    return;
  }
  for (int64_t x = CellOf(low.x()); x <= x_end; ++x) {
    for (int64_t y = CellOf(low.y()); y <= y_end; ++y) {
      const uint64_t first = Pack(x, y, CellOf(low.z()));
      const uint64_t last = Pack(x, y, CellOf(high.z()));
      auto entry = std::lower_bound(entries_.begin(), entries_.end(), first,
                                    [](const Entry& at, uint64_t cell) { return at.cell < cell; });
      for (; entry != entries_.end() && entry->cell <= last; ++entry) visit(entry->place);
    }
  }
}

namespace {}  // namespace

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
  StopCounter counter(stop, kPlacesPerStop);
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
  StopCounter counter(stop, kPlacesPerStop);
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

absl::StatusOr<PlanningAnnex*> PlanningAnnex::Of(const PlaceGraph& graph, const StopCheck& stop) {
  const auto make = [&]() -> absl::StatusOr<std::unique_ptr<PlaceGraph::Annex>> {
    DSG_ASSIGN_OR_RETURN(RoomGraph rooms, RoomGraph::Build(graph, stop));
    DSG_ASSIGN_OR_RETURN(PlaceLocator locator, PlaceLocator::Build(graph, stop));
    return std::make_unique<PlanningAnnex>(std::move(rooms), std::move(locator));
  };
  DSG_ASSIGN_OR_RETURN(PlaceGraph::Annex * annex, graph.annex(stop, make));
  // Planning is the only one that makes any.
  return static_cast<PlanningAnnex*>(annex);
}

}  // namespace dsg::query
