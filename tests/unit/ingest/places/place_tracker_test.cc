// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/place_tracker.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <set>

#include "ingest/places/extract_places.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/places/plan_map.h"

namespace dsg::ingest {
namespace {

PlaceGraph GraphOf(const std::vector<Eigen::Vector3d>& points) {
  PlaceGraph graph;
  for (const Eigen::Vector3d& point : points) {
    Place place;
    place.position_map = point;
    graph.places.push_back(place);
  }
  return graph;
}

TEST(PlaceTracker, GivesNewIdsInOrderAndKeepsThoseNearby) {
  PlaceTracker tracker;
  PlaceGraph graph = GraphOf({{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {4.0, 0.0, 0.0}});
  tracker.Track(&graph);
  EXPECT_EQ(graph.places[2].id, 2);
  graph = GraphOf({{4.1, 0.1, 0.0}, {9.0, 0.0, 0.0}, {0.2, 0.0, 0.0}});
  graph.links = {{0, 1, 0.3}, {1, 2, 0.4}};
  tracker.Track(&graph);
  ASSERT_EQ(graph.places.size(), 3u);
  EXPECT_EQ(graph.places[0].id, 0);
  EXPECT_EQ(graph.places[0].position_map.x(), 0.2);
  EXPECT_EQ(graph.places[1].id, 2);
  EXPECT_EQ(graph.places[2].id, 3);
  ASSERT_EQ(graph.links.size(), 2u);
  EXPECT_EQ(graph.links[0].from, 0);
  EXPECT_EQ(graph.links[0].to, 2);
  EXPECT_EQ(graph.links[0].clearance_m, 0.4);
  EXPECT_EQ(graph.links[1].from, 1);
}

TEST(PlaceTracker, MatchesOneToOneAndNeverGivesAnIdTwice) {
  PlaceTracker tracker;
  PlaceGraph graph = GraphOf({{0.0, 0.0, 0.0}});
  tracker.Track(&graph);
  graph = GraphOf({{0.3, 0.0, 0.0}, {-0.2, 0.0, 0.0}});
  tracker.Track(&graph);
  EXPECT_EQ(graph.places[0].id, 0);
  EXPECT_EQ(graph.places[0].position_map.x(), -0.2);
  EXPECT_EQ(graph.places[1].id, 1);
  graph = GraphOf({});
  tracker.Track(&graph);
  graph = GraphOf({{0.0, 0.0, 0.0}});
  tracker.Track(&graph);
  EXPECT_EQ(graph.places[0].id, 2);
}

// Of the places of `now`, the share that has the id it had before.
double ShareKept(const PlaceGraph& before, const PlaceGraph& now) {
  std::set<int64_t> ids;
  for (const Place& place : before.places) ids.insert(place.id);
  size_t kept = 0;
  for (const Place& place : now.places) kept += ids.count(place.id);
  return static_cast<double>(kept) / static_cast<double>(before.places.size());
}

TEST(PlaceTracker, KeepsMostIdsWhileTheMapGrows) {
  const PlanMap map = MapPlan(simulator::WorldKind::kApartment, 1, 0.02);
  PlaceOptions options;
  options.floors_m = {0.0};
  PlaceTracker tracker;
  PlaceGraph before;
  for (const double seen_x_m : {6.0, 8.0, 10.0, 100.0}) {
    OccupancyGrid grid = map.grid;
    Fill({seen_x_m, -9.0, -9.0}, {99.0, 99.0, 9.0}, Occupancy::kUnknown, &grid);
    PlaceGraph graph = ExtractPlaces(grid, {}, options);
    tracker.Track(&graph);
    if (!before.places.empty()) {
      const double kept = ShareKept(before, graph);
      std::printf("up to %.0f m: %.2f of the ids kept\n", seen_x_m, kept);
      EXPECT_GE(kept, 0.8);
    }
    before = graph;
  }
}

TEST(PlaceTracker, KeepsMostIdsWhenTheMapTrembles) {
  PlaceOptions options;
  options.floors_m = {0.0};
  const PlanMap map = MapPlan(simulator::WorldKind::kApartment, 2, 0.02);
  PlaceTracker tracker;
  PlaceGraph before = ExtractPlaces(map.grid, map.path_map, options);
  tracker.Track(&before);
  Random random(2, 0);
  OccupancyGrid grid = map.grid;
  // One in a hundred cells at a surface changes sides.
  for (int64_t i = 1; i < grid.frame.CellCount(); ++i) {
    const bool is_surface =
        map.grid.cells[i] == Occupancy::kOccupied && map.grid.cells[i - 1] == Occupancy::kFree;
    if (is_surface && random.Chance(0.01)) grid.cells[i - 1] = Occupancy::kOccupied;
  }
  PlaceGraph now = ExtractPlaces(grid, map.path_map, options);
  tracker.Track(&now);
  std::printf("%.2f of the ids kept\n", ShareKept(before, now));
  EXPECT_GE(ShareKept(before, now), 0.75);
}

TEST(NearestPlaceInSight, DoesNotLookThroughWalls) {
  OccupancyGrid grid = MakeHall({8.0, 4.0, 2.6});
  Fill({3.9, 0.0, 0.0}, {4.1, 4.0, 3.0}, Occupancy::kOccupied, &grid);
  // A table on the way to the right place, which one looks over.
  Fill({2.6, 1.0, 0.0}, {3.0, 3.0, 0.8}, Occupancy::kOccupied, &grid);
  const DistanceField field(grid);
  const PlaceGraph graph = GraphOf({{4.6, 2.0, 0.0}, {1.5, 2.0, 0.0}});
  EXPECT_EQ(NearestPlaceInSight(graph, field, {3.5, 2.0, 1.1}, {}), 1);
  EXPECT_EQ(NearestPlaceInSight(graph, field, {3.5, 2.0, 0.3}, {}), 1);
  EXPECT_EQ(NearestPlaceInSight(graph, field, {4.5, 2.0, 1.1}, {}), 0);
}

TEST(NearestPlaceInSight, FallsBackToTheNearestAndToNone) {
  OccupancyGrid grid = MakeHall({8.0, 4.0, 2.6});
  Fill({3.0, 0.0, 0.0}, {5.0, 4.0, 3.0}, Occupancy::kOccupied, &grid);
  const DistanceField field(grid);
  EXPECT_EQ(
      NearestPlaceInSight(GraphOf({{6.0, 2.0, 0.0}, {7.0, 2.0, 0.0}}), field, {1.0, 2.0, 1.0}, {}),
      0);
  EXPECT_EQ(NearestPlaceInSight({}, field, {1.0, 2.0, 1.0}, {}), -1);
  EXPECT_EQ(NearestPlaceInSight(GraphOf({{6.0, 2.0, 0.0}}), DistanceField(), {1.0, 2.0, 1.0}, {}),
            0);
}

}  // namespace
}  // namespace dsg::ingest
