// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/place_graph.h"

#include <algorithm>
#include <cmath>

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
  Place best;
  double best_score = -1.0;
  for (int i = -kSamples; i <= kSamples; ++i) {
    for (int j = -kSamples; j <= kSamples; ++j) {
      const Point offset = tile.sizes().cwiseProduct(Point(i, j)) / (2 * kSamples + 1);
      const Point position = tile.center() + offset;
      const double clearance = free_space.Clearance(position);
      const double score = std::min(clearance, 0.6) - 0.2 * offset.norm();
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

void SampleDoors(const FloorPlan& plan, int room, const FreeSpace& free_space,
                 std::vector<Place>* places) {
  for (size_t i = 0; i < plan.doors.size(); ++i) {
    const Door& door = plan.doors[i];
    if (door.room != room) continue;
    places->push_back({door.center, room, static_cast<int>(i), free_space.Clearance(door.center)});
  }
}

std::vector<PlaceEdge> Connect(const std::vector<Place>& places, const FreeSpace& free_space) {
  std::vector<PlaceEdge> edges;
  for (int i = 0; i < static_cast<int>(places.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(places.size()); ++j) {
      const Place& a = places[i];
      const Place& b = places[j];
      const bool at_door = a.door >= 0 || b.door >= 0;
      // Only a doorway joins two rooms.
      if (a.room != b.room && !at_door) continue;
      const double reach = at_door ? kDoorStepM : kStepM;
      if ((a.position - b.position).squaredNorm() > reach * reach) continue;
      const double clearance = free_space.SegmentClearance(a.position, b.position);
      if (clearance >= kWalkClearanceM) edges.push_back({i, j, clearance});
    }
  }
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
  graph.edges = Connect(graph.places, free_space);
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
  for (int other = 0; other < static_cast<int>(plan.rooms.size()); ++other) {
    // All doors open to the spine, room 0.
    if (other == room || room == 0) SampleDoors(plan, other, free_space, &graph.places);
  }
  if (inside_count == 0 || graph.places.size() == inside_count) return false;
  graph.edges = Connect(graph.places, free_space);
  const std::vector<bool> reached = ReachedFrom(graph, static_cast<int>(inside_count));
  const auto begin_doors = reached.begin() + static_cast<ptrdiff_t>(inside_count);
  if (std::count(begin_doors, reached.end(), false) > 0) return false;
  const auto count = static_cast<double>(std::count(reached.begin(), begin_doors, true));
  return count >= 1 && count >= kReachedShareMin * static_cast<double>(inside_count);
}

}  // namespace dsg::simulator
