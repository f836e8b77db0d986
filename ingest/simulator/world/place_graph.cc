// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/place_graph.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace dsg::simulator {
namespace {

constexpr double kSpacingM = 1.0;
constexpr double kPlaceClearanceM = 0.35;
constexpr double kStepM = 1.75;
/// A doorway reaches over the keep-out in front of it.
constexpr double kDoorStepM = 2.2;
constexpr double kReachedShareMin = 0.8;

// The roomiest spot of a grid cell, near its middle when there is space enough.
Place BestSpot(const Rect& tile, int room, const FreeSpace& free_space) {
  constexpr int kSamples = 3;
  constexpr double kRoomyM = 0.6;
  // Nothing scores better than a roomy middle.
  const double at_middle = free_space.Clearance(tile.center());
  if (at_middle >= kRoomyM) return {tile.center(), room, -1, at_middle};
  Place best;
  double best_score = -1.0;
  for (int i = -kSamples; i <= kSamples; ++i) {
    for (int j = -kSamples; j <= kSamples; ++j) {
      const Point offset = tile.sizes().cwiseProduct(Point(i, j)) / (2 * kSamples + 1);
      const Point position = tile.center() + offset;
      const double clearance = free_space.Clearance(position);
      const double score = std::min(clearance, kRoomyM) - 0.2 * offset.norm();
      if (clearance >= kPlaceClearanceM && score > best_score) {
        best_score = score;
        best = {position, room, -1, clearance};
      }
    }
  }
  return best;
}

void SampleRoom(const FloorPlan& plan, int room, const FreeSpace& free_space,
                std::vector<Place>* places) {
  const Rect interior = plan.rooms[room].Interior();
  const Point size = interior.sizes();
  const int columns = std::max(1, static_cast<int>(std::lround(size.x() / kSpacingM)));
  const int rows = std::max(1, static_cast<int>(std::lround(size.y() / kSpacingM)));
  const Point tile(size.x() / columns, size.y() / rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Point low = interior.min() + tile.cwiseProduct(Point(column, row));
      const Place spot = BestSpot(Rect(low, low + tile), room, free_space);
      if (spot.clearance_m > 0.0) places->push_back(spot);
    }
  }
}

Place DoorPlace(const FloorPlan& plan, int door, const FreeSpace& free_space) {
  const Door& at = plan.doors[door];
  return {at.center, at.room_b, door, free_space.Clearance(at.center)};
}

void SampleDoors(const FloorPlan& plan, int room, const FreeSpace& free_space,
                 std::vector<Place>* places) {
  for (size_t i = 0; i < plan.doors.size(); ++i) {
    if (plan.doors[i].room_b != room) continue;
    places->push_back(DoorPlace(plan, static_cast<int>(i), free_space));
  }
}

// A doorway belongs to both of its rooms; only a doorway joins two rooms.
bool ShareRoom(const FloorPlan& plan, const Place& a, const Place& b) {
  const auto is_in = [&](const Place& place, int room) {
    return place.door >= 0 ? plan.doors[place.door].Joins(room) : place.room == room;
  };
  if (a.door < 0) return is_in(b, a.room);
  const Door& door = plan.doors[a.door];
  return is_in(b, door.room_a) || is_in(b, door.room_b);
}

std::vector<PlaceEdge> Connect(const FloorPlan& plan, const std::vector<Place>& places,
                               const FreeSpace& free_space) {
  // From west to east, so that each place meets only those within reach to its east.
  std::vector<int> order(places.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return places[a].position.x() < places[b].position.x(); });
  std::vector<PlaceEdge> edges;
  for (size_t i = 0; i < order.size(); ++i) {
    const Place& a = places[order[i]];
    for (size_t j = i + 1; j < order.size(); ++j) {
      const Place& b = places[order[j]];
      if (b.position.x() - a.position.x() > kDoorStepM) break;
      const double reach = a.door >= 0 || b.door >= 0 ? kDoorStepM : kStepM;
      if ((a.position - b.position).squaredNorm() > reach * reach) continue;
      if (!ShareRoom(plan, a, b)) continue;
      if (!free_space.SegmentKeepsClear(a.position, b.position, kWalkClearanceM)) continue;
      edges.push_back({std::min(order[i], order[j]), std::max(order[i], order[j])});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const PlaceEdge& a, const PlaceEdge& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  return edges;
}

std::vector<bool> ReachedFrom(const PlaceGraph& graph, int start) {
  const auto neighbours = graph.Neighbours();
  std::vector<bool> reached(graph.places.size(), false);
  std::vector<int> open = {start};
  reached[start] = true;
  while (!open.empty()) {
    const int current = open.back();
    open.pop_back();
    for (const int next : neighbours[current]) {
      if (reached[next]) continue;
      reached[next] = true;
      open.push_back(next);
    }
  }
  return reached;
}

PlaceGraph KeepOnly(const PlaceGraph& graph, const std::vector<bool>& kept) {
  PlaceGraph out;
  std::vector<int> renumbered(graph.places.size(), -1);
  for (size_t i = 0; i < graph.places.size(); ++i) {
    if (!kept[i]) continue;
    renumbered[i] = static_cast<int>(out.places.size());
    out.places.push_back(graph.places[i]);
  }
  for (const PlaceEdge& edge : graph.edges) {
    if (!kept[edge.from] || !kept[edge.to]) continue;
    out.edges.push_back({renumbered[edge.from], renumbered[edge.to], edge.clearance_m});
  }
  return out;
}

}  // namespace

std::vector<std::vector<int>> PlaceGraph::Neighbours() const {
  std::vector<std::vector<int>> neighbours(places.size());
  for (const PlaceEdge& edge : edges) {
    neighbours[edge.from].push_back(edge.to);
    neighbours[edge.to].push_back(edge.from);
  }
  for (std::vector<int>& list : neighbours) std::sort(list.begin(), list.end());
  return neighbours;
}

PlaceGraph BuildPlaceGraph(const FloorPlan& plan, const FreeSpace& free_space) {
  PlaceGraph graph;
  for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
    SampleRoom(plan, room, free_space, &graph.places);
    SampleDoors(plan, room, free_space, &graph.places);
  }
  graph.edges = Connect(plan, graph.places, free_space);
  for (PlaceEdge& edge : graph.edges) {
    edge.clearance_m = free_space.SegmentClearance(graph.places[edge.from].position,
                                                   graph.places[edge.to].position);
  }
  const auto first_door = std::find_if(graph.places.begin(), graph.places.end(),
                                       [](const Place& place) { return place.door == 0; });
  if (first_door == graph.places.end()) return graph;
  const auto start = static_cast<int>(first_door - graph.places.begin());
  return KeepOnly(graph, ReachedFrom(graph, start));
}

bool IsRoomWalkable(const FloorPlan& plan, int room, const FreeSpace& free_space) {
  PlaceGraph graph;
  SampleRoom(plan, room, free_space, &graph.places);
  const size_t inside_count = graph.places.size();
  for (size_t i = 0; i < plan.doors.size(); ++i) {
    if (!plan.doors[i].Joins(room)) continue;
    graph.places.push_back(DoorPlace(plan, static_cast<int>(i), free_space));
  }
  if (inside_count == 0 || graph.places.size() == inside_count) return false;
  graph.edges = Connect(plan, graph.places, free_space);
  const std::vector<bool> reached = ReachedFrom(graph, static_cast<int>(inside_count));
  const auto begin_doors = reached.begin() + static_cast<ptrdiff_t>(inside_count);
  if (std::count(begin_doors, reached.end(), false) > 0) return false;
  const auto count = static_cast<double>(std::count(reached.begin(), begin_doors, true));
  return count >= 1 && count >= kReachedShareMin * static_cast<double>(inside_count);
}

}  // namespace dsg::simulator
