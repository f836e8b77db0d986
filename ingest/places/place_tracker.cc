// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/place_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace dsg::ingest {
namespace {

using Bin = std::array<int64_t, 3>;

Bin BinOf(const Eigen::Vector3d& point, double edge_m) {
  const Eigen::Vector3d bin = (point / edge_m).array().floor();
  return {static_cast<int64_t>(bin.x()), static_cast<int64_t>(bin.y()),
          static_cast<int64_t>(bin.z())};
}

// Distance, old id, old place, new place.
using Match = std::tuple<double, int64_t, int, int>;

std::vector<Match> FindMatches(const std::vector<Place>& old_places,
                               const std::vector<Place>& new_places, double same_m) {
  std::map<Bin, std::vector<int>> bins;
  for (int i = 0; i < static_cast<int>(old_places.size()); ++i) {
    bins[BinOf(old_places[static_cast<size_t>(i)].position_map, same_m)].push_back(i);
  }
  std::vector<Match> matches;
  for (int i = 0; i < static_cast<int>(new_places.size()); ++i) {
    const Eigen::Vector3d& at = new_places[static_cast<size_t>(i)].position_map;
    const Bin bin = BinOf(at, same_m);
    for (int k = 0; k < 27; ++k) {
      const auto found =
          bins.find({bin[0] + k % 3 - 1, bin[1] + k / 3 % 3 - 1, bin[2] + k / 9 - 1});
      if (found == bins.end()) continue;
      for (const int other : found->second) {
        const Place& old_place = old_places[static_cast<size_t>(other)];
        const double distance_m = (old_place.position_map - at).norm();
        if (distance_m <= same_m) matches.emplace_back(distance_m, old_place.id, other, i);
      }
    }
  }
  std::sort(matches.begin(), matches.end());
  return matches;
}

// The nearest first, at most `count_max`.
std::vector<int> NearestPlaces(const PlaceGraph& graph, const Eigen::Vector3d& point_map,
                               size_t count_max) {
  std::vector<std::pair<double, int>> near;
  near.reserve(graph.places.size());
  for (const Place& place : graph.places) {
    near.emplace_back((place.position_map - point_map).squaredNorm(),
                      static_cast<int>(near.size()));
  }
  const size_t count = std::min(count_max, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  std::vector<int> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(near[i].second);
  return nearest;
}

bool IsOnFloor(const Place& place) { return place.position_map.z() == place.floor_z_m; }

bool IsInSight(const Place& place, const DistanceField& field, const Eigen::Vector3d& point_map,
               const PlaceOptions& options) {
  return IsPlaceInSight(place.position_map, IsOnFloor(place), field, point_map, options);
}

// No wall is between, whatever stands in front of the point.
bool IsInSameRoom(const Place& place, const DistanceField& field, const Eigen::Vector3d& point_map,
                  const PlaceOptions& options) {
  if (!IsOnFloor(place)) return false;
  const double z = place.floor_z_m + options.above_furniture_m;
  return field.HasLineOfSight({point_map.x(), point_map.y(), z},
                              {place.position_map.x(), place.position_map.y(), z},
                              options.sight_forgiven_m);
}

void SortById(PlaceGraph* graph) {
  std::vector<int> order(graph->places.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return graph->places[static_cast<size_t>(a)].id < graph->places[static_cast<size_t>(b)].id;
  });
  std::vector<int> index_of(order.size());
  std::vector<Place> places;
  places.reserve(order.size());
  for (const int old_index : order) {
    index_of[static_cast<size_t>(old_index)] = static_cast<int>(places.size());
    places.push_back(graph->places[static_cast<size_t>(old_index)]);
  }
  graph->places = std::move(places);
  for (PlaceLink& link : graph->links) {
    const auto [low, high] = std::minmax(index_of[static_cast<size_t>(link.from)],
                                         index_of[static_cast<size_t>(link.to)]);
    link = {low, high, link.clearance_m};
  }
  std::sort(graph->links.begin(), graph->links.end(), [](const PlaceLink& a, const PlaceLink& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
}

}  // namespace

void PlaceTracker::Track(PlaceGraph* graph) {
  std::vector<bool> is_used(last_.places.size(), false);
  for (Place& place : graph->places) place.id = -1;
  for (const auto& [distance_m, id, old_index, new_index] :
       FindMatches(last_.places, graph->places, same_m_)) {
    Place& place = graph->places[static_cast<size_t>(new_index)];
    if (place.id >= 0 || is_used[static_cast<size_t>(old_index)]) continue;
    place.id = id;
    is_used[static_cast<size_t>(old_index)] = true;
  }
  for (Place& place : graph->places) {
    if (place.id < 0) place.id = next_id_++;
  }
  SortById(graph);
  last_ = *graph;
}

bool IsPlaceInSight(const Eigen::Vector3d& place_map, bool is_on_floor, const DistanceField& field,
                    const Eigen::Vector3d& point_map, const PlaceOptions& options) {
  Eigen::Vector3d at = place_map;
  if (is_on_floor) {
    const double low_m = place_map.z() + options.eye_low_m;
    at.z() = std::clamp(point_map.z(), low_m, std::max(low_m, place_map.z() + options.eye_high_m));
  }
  return field.HasLineOfSight(point_map, at, options.sight_forgiven_m);
}

int NearestPlaceInSight(const PlaceGraph& graph, const DistanceField& field,
                        const Eigen::Vector3d& point_map, const PlaceOptions& options) {
  if (graph.places.empty() || !point_map.allFinite()) return -1;
  const std::vector<int> near =
      NearestPlaces(graph, point_map, static_cast<size_t>(options.sight_place_count));
  for (const int index : near) {
    if (IsInSight(graph.places[static_cast<size_t>(index)], field, point_map, options))
      return index;
  }
  for (const int index : near) {
    if (IsInSameRoom(graph.places[static_cast<size_t>(index)], field, point_map, options))
      return index;
  }
  return near.front();
}

void PlaceTracker::Move(const PointMove& move) {
  for (Place& place : last_.places)
    place.position_map = move(place.position_map) * place.position_map;
}

}  // namespace dsg::ingest
