// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/extract_places.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "ingest/places/connect_places.h"
#include "ingest/places/cover_space.h"
#include "ingest/places/free_box.h"
#include "ingest/places/link_places.h"
#include "ingest/places/roadmap.h"
#include "ingest/places/shortcuts.h"
#include "ingest/places/space_grid.h"
#include "ingest/places/storey_links.h"
#include "ingest/places/thin_out.h"
#include "ingest/places/voronoi_places.h"

namespace dsg::ingest {
namespace {

using Path = std::vector<Eigen::Vector3d>;

bool IsSane(const PlaceOptions& options) {
  return std::isfinite(options.robot_radius_m) && options.robot_radius_m > 0.0;
}

Path FinitePoints(const Path& path_map) {
  Path points;
  for (const Eigen::Vector3d& point : path_map) {
    if (point.allFinite()) points.push_back(point);
  }
  return points;
}

// The part of a path on one floor, and whether it was driven: a camera in a hand also passes over
// tables, which does not make them free.
struct FloorPath {
  Path points;
  bool is_driven = false;
};

FloorPath OnFloor(const Path& path_map, double floor_z_m, const PlaceOptions& options) {
  FloorPath path;
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : path_map) {
    if (point.z() < floor_z_m - options.below_floor_m) continue;
    if (point.z() > floor_z_m + options.path_height_m) continue;
    path.points.push_back(point);
    heights.push_back(point.z());
  }
  if (heights.empty()) return path;
  std::sort(heights.begin(), heights.end());
  const double middle = heights[heights.size() / 2];
  const auto level_count = std::count_if(heights.begin(), heights.end(), [&](double height) {
    return std::abs(height - middle) <= options.wheels_m;
  });
  path.is_driven = static_cast<double>(level_count) >=
                   options.wheels_share * static_cast<double>(heights.size());
  return path;
}

void Draw(const Path& path_map, const PlaceOptions& options, Roadmap* roadmap) {
  AddVoronoiPlaces(options, roadmap);
  CoverPath(path_map, options, roadmap);
  CoverSpace(options, roadmap);
  LinkNeighbours(options, roadmap);
  // In the air there is a way around on every side.
  if (roadmap->space().IsFlat()) AddShortcuts(options, roadmap);
  ConnectParts(options, roadmap);
}

// Places in the order of their cells. Links are measured again: what is stored is proven.
PlaceGraph Tell(const Roadmap& roadmap, const OccupancyGrid& seen, const PlaceOptions& options) {
  const OpenSpace& space = roadmap.space();
  std::vector<int> order(roadmap.cells().size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return roadmap.cell(a) < roadmap.cell(b); });
  std::vector<int> index_of(order.size());
  PlaceGraph graph;
  for (const int spot : order) {
    index_of[static_cast<size_t>(spot)] = static_cast<int>(graph.places.size());
    Place place;
    place.position_map = roadmap.position_map(spot);
    place.clearance_m = space.ClearanceM(roadmap.cell(spot));
    place.basis_point_count = CountBasisPoints(space, roadmap.cell(spot), options);
    place.free_box = GrowFreeBox(seen, space.frame().Cell(roadmap.cell(spot)), options.free_box_m);
    place.free_box.translate(-place.position_map);
    graph.places.push_back(place);
  }
  for (const auto& [a, b] : roadmap.links()) {
    const double clearance_m =
        space.field().SegmentClearanceM(roadmap.position_map(a), roadmap.position_map(b));
    if (clearance_m + OpenSpace::kRoundingM < space.robot_radius_m()) continue;
    const auto [low, high] =
        std::minmax(index_of[static_cast<size_t>(a)], index_of[static_cast<size_t>(b)]);
    graph.links.push_back({low, high, clearance_m});
  }
  std::sort(graph.links.begin(), graph.links.end(), [](const PlaceLink& a, const PlaceLink& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  return graph;
}

PlaceGraph ExtractFrom(OccupancyGrid seen, const Path& path_map, bool is_path_free,
                       const PlaceOptions& options) {
  if (is_path_free) StampPath(path_map, options.footprint_m, &seen);
  KeepReached(path_map, &seen);
  OccupancyGrid sure = seen;
  ShrinkFromUnknown(&sure);
  const OpenSpace space(std::move(sure), options.robot_radius_m);
  Roadmap roadmap(&space);
  Draw(path_map, options, &roadmap);
  return Tell(ThinOut(roadmap, options), seen, options);
}

void Append(const PlaceGraph& more, PlaceGraph* graph) {
  const int first = static_cast<int>(graph->places.size());
  graph->places.insert(graph->places.end(), more.places.begin(), more.places.end());
  for (const PlaceLink& link : more.links) {
    graph->links.push_back({link.from + first, link.to + first, link.clearance_m});
  }
}

PlaceGraph ExtractOnFloor(const OccupancyGrid& grid, const Path& path_map, double floor_z_m,
                          const PlaceOptions& options) {
  const FloorPath path = OnFloor(path_map, floor_z_m, options);
  OccupancyGrid flat = ProjectToFloor(grid, floor_z_m, options);
  if (flat.cells.empty()) return {};
  PlaceGraph graph = ExtractFrom(std::move(flat), path.points, path.is_driven, options);
  for (Place& place : graph.places) {
    place.position_map.z() = floor_z_m;
    place.floor_z_m = floor_z_m;
    place.free_box.min().z() = 0.0;
    place.free_box.max().z() = options.body_z_max_m;
  }
  return graph;
}

// The highest floor below a point, else the lowest of all; its own height without floors.
double FloorBelow(const std::vector<double>& floors_m, double z_m) {
  if (floors_m.empty()) return z_m;
  double floor_z_m = floors_m.front();
  for (const double candidate : floors_m) {
    if (candidate <= z_m) floor_z_m = candidate;
  }
  return floor_z_m;
}

}  // namespace

PlaceGraph ExtractPlaces(const OccupancyGrid& grid, const std::vector<Eigen::Vector3d>& path_map,
                         const PlaceOptions& options) {
  if (!IsSound(grid) || !IsSane(options)) return {};
  const Path path = FinitePoints(path_map);
  const std::vector<double> floors_m =
      options.floors_m.empty() ? FindFloors(grid, path, options) : options.floors_m;
  if (options.mode == PlaceMode::kVolume) {
    PlaceGraph graph = ExtractFrom(grid, path, true, options);
    for (Place& place : graph.places) {
      place.floor_z_m = FloorBelow(floors_m, place.position_map.z());
    }
    return graph;
  }
  PlaceGraph graph;
  for (const double floor_z_m : floors_m) {
    Append(ExtractOnFloor(grid, path, floor_z_m, options), &graph);
  }
  LinkStoreys(path, floors_m, options, &graph);
  return graph;
}

}  // namespace dsg::ingest
