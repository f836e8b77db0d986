// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ingest/places/extract_places.h"
#include "schema/base/disjoint_sets.h"
#include "tests/unit/ingest/places/plan_map.h"

namespace dsg::ingest {
namespace {

constexpr Occupancy kSolid = Occupancy::kOccupied;

// 10 m x 8 m, floors at 0 and 3 m, with a stairwell of 2 m x 4 m and stairs in it.
OccupancyGrid TwoStoreys() {
  OccupancyGrid grid = MakeHall({10.0, 8.0, 5.6});
  Fill({0.0, 0.0, 2.8}, {10.0, 8.0, 3.0}, kSolid, &grid);
  Fill({1.0, 2.0, 2.8}, {3.0, 6.0, 3.0}, Occupancy::kFree, &grid);
  for (int step = 0; step < 12; ++step) {
    const double y = 2.0 + 0.3 * step;
    Fill({1.0, y, 0.0}, {2.0, y + 0.3, 0.2 * (step + 1)}, kSolid, &grid);
  }
  return grid;
}

TEST(FindFloors, FindsTheOneFloorDespiteTablesAndHoles) {
  OccupancyGrid grid = MakeHall({8.0, 6.0, 2.6});
  Fill({1.0, 1.0, 0.6}, {4.0, 5.0, 0.8}, kSolid, &grid);
  Fill({5.0, 1.0, -0.1}, {7.0, 5.0, 0.0}, Occupancy::kUnknown, &grid);
  Fill({0.0, 0.0, 2.4}, {8.0, 6.0, 2.6}, kSolid, &grid);
  ASSERT_EQ(FindFloors(grid, {}, {}).size(), 1u);
  // Of cells that reach up to 0.
  EXPECT_NEAR(FindFloors(grid, {{4.0, 3.0, 1.2}}, {})[0], 0.0, 0.11);
}

TEST(FindFloors, FindsBothStoreysAroundAStairwell) {
  const std::vector<double> floors_m = FindFloors(TwoStoreys(), {}, {});
  ASSERT_EQ(floors_m.size(), 2u);
  EXPECT_NEAR(floors_m[1] - floors_m[0], 3.0, 0.11);
  EXPECT_LT(floors_m[0], floors_m[1]);
}

TEST(FindFloors, LeavesOutStoreysThatTheRobotOnlySaw) {
  const std::vector<double> floors_m = FindFloors(TwoStoreys(), {{8.0, 4.0, 1.2}}, {});
  ASSERT_EQ(floors_m.size(), 1u);
  EXPECT_NEAR(floors_m[0], 0.0, 0.11);
}

TEST(FindFloors, LiftsAFloorWhoseNoiseReachesTheNextLayer) {
  OccupancyGrid grid = MakeHall({8.0, 6.0, 2.6});
  Fill({0.0, 0.0, 0.0}, {4.0, 6.0, 0.1}, kSolid, &grid);
  const std::vector<double> floors_m = FindFloors(grid, {}, {});
  ASSERT_EQ(floors_m.size(), 1u);
  PlaceOptions options;
  options.floors_m = floors_m;
  const OccupancyGrid flat = ProjectToFloor(grid, floors_m[0], options);
  for (const Occupancy cell : flat.cells) ASSERT_EQ(cell, Occupancy::kFree);
}

TEST(FindFloors, FindsWhatTheOptionsSay) {
  PlaceOptions options;
  options.storey_m_min = 3.5;
  EXPECT_EQ(FindFloors(TwoStoreys(), {}, options).size(), 1u);
  options = {};
  options.floor_m2_min = 1000.0;
  EXPECT_TRUE(FindFloors(TwoStoreys(), {}, options).empty());
}

TEST(FindFloors, FindsNoneInNothing) {
  EXPECT_TRUE(FindFloors({}, {}, {}).empty());
  OccupancyGrid grid = MakeHall({3.0, 3.0, 2.0});
  for (Occupancy& cell : grid.cells) cell = Occupancy::kUnknown;
  EXPECT_TRUE(FindFloors(grid, {{1.0, 1.0, 1.0}}, {}).empty());
}

TEST(ProjectToFloor, HoldsTheFloorAndItsCells) {
  for (const double floor_z_m : {0.0, 0.07, 0.1, 0.3, -0.4, 2.9999999}) {
    const OccupancyGrid flat = ProjectToFloor(MakeHall({4.0, 3.0, 6.0}), floor_z_m, {});
    EXPECT_EQ(flat.frame.size, Eigen::Vector3i(40, 30, 1));
    EXPECT_EQ(flat.frame.CellOf({1.0, 1.0, floor_z_m}).z(), 0) << floor_z_m;
  }
}

TEST(ProjectToFloor, JudgesAColumnByItsObstaclesAndByWhatWasSeenOfIt) {
  OccupancyGrid grid = MakeHall({4.0, 1.0, 2.6});
  Fill({0.0, 0.0, 0.7}, {0.5, 1.0, 0.8}, kSolid, &grid);
  // Below the field of view, and behind the back of a sofa.
  Fill({1.0, 0.0, 0.0}, {1.5, 1.0, 0.4}, Occupancy::kUnknown, &grid);
  Fill({2.0, 0.0, 0.0}, {2.5, 1.0, 0.9}, Occupancy::kUnknown, &grid);
  Fill({3.0, 0.0, 2.0}, {3.5, 1.0, 2.6}, kSolid, &grid);
  const OccupancyGrid flat = ProjectToFloor(grid, 0.0, {});
  EXPECT_EQ(flat.AtPoint({0.25, 0.55, 0.0}), Occupancy::kOccupied) << "under a table";
  EXPECT_EQ(flat.AtPoint({0.75, 0.55, 0.0}), Occupancy::kFree);
  EXPECT_EQ(flat.AtPoint({1.25, 0.55, 0.0}), Occupancy::kFree) << "feet not seen";
  EXPECT_EQ(flat.AtPoint({2.25, 0.55, 0.0}), Occupancy::kUnknown) << "lower half not seen";
  EXPECT_EQ(flat.AtPoint({3.25, 0.55, 0.0}), Occupancy::kFree) << "under a lintel";
}

TEST(ProjectToFloor, DoesNotDriveThroughABoardThatLeftOnlyAGap) {
  OccupancyGrid grid = MakeHall({4.0, 3.0, 2.6});
  Fill({1.0, 1.0, 0.6}, {2.0, 2.0, 0.8}, Occupancy::kUnknown, &grid);
  Fill({3.0, 1.0, 0.6}, {3.1, 1.1, 0.8}, Occupancy::kUnknown, &grid);
  const OccupancyGrid flat = ProjectToFloor(grid, 0.0, {});
  EXPECT_EQ(flat.AtPoint({1.55, 1.55, 0.0}), Occupancy::kUnknown);
  EXPECT_EQ(flat.AtPoint({3.05, 1.05, 0.0}), Occupancy::kFree) << "a reading that is missing";
}

TEST(ProjectToFloor, TakesNoiseOfTheFloorForFloor) {
  for (const double floor_z_m : {-0.06, 0.0, 0.03}) {
    OccupancyGrid grid = MakeHall({2.0, 2.0, 2.6});
    Fill({0.5, 0.5, 0.0}, {1.5, 1.5, 0.1}, kSolid, &grid);
    const OccupancyGrid flat = ProjectToFloor(grid, floor_z_m, {});
    EXPECT_EQ(flat.AtPoint({1.05, 1.05, floor_z_m}), Occupancy::kFree) << floor_z_m;
  }
}

TEST(ProjectToFloor, BlocksAStairwell) {
  const OccupancyGrid flat = ProjectToFloor(TwoStoreys(), 3.0, {});
  EXPECT_EQ(flat.AtPoint({2.55, 4.05, 3.0}), Occupancy::kOccupied);
  EXPECT_EQ(flat.AtPoint({6.05, 4.05, 3.0}), Occupancy::kFree);
}

TEST(ExtractPlaces, LiesOnBothStoreys) {
  const OccupancyGrid grid = TwoStoreys();
  const PlaceGraph graph = ExtractPlaces(grid, {}, {});
  const std::vector<double> floors_m = FindFloors(grid, {}, {});
  int counts[2] = {0, 0};
  for (const Place& place : graph.places) {
    ASSERT_TRUE(place.floor_z_m == floors_m[0] || place.floor_z_m == floors_m[1]);
    EXPECT_EQ(place.position_map.z(), place.floor_z_m);
    const bool is_up = place.floor_z_m == floors_m[1];
    ++counts[is_up ? 1 : 0];
    const Eigen::Vector3d& at = place.position_map;
    const bool is_in_well = at.x() > 1.1 && at.x() < 2.9 && at.y() > 2.1 && at.y() < 5.9;
    EXPECT_FALSE(is_up && is_in_well) << "there is no floor: " << at.transpose();
  }
  EXPECT_GT(counts[0], 10);
  EXPECT_GT(counts[1], 10);
}

// A body 1 m above the floor goes through these points, a pose each 0.2 m.
std::vector<Eigen::Vector3d> PathOver(const std::vector<Eigen::Vector3d>& feet_map) {
  std::vector<Eigen::Vector3d> path_map;
  for (size_t i = 0; i + 1 < feet_map.size(); ++i) {
    const Eigen::Vector3d way = feet_map[i + 1] - feet_map[i];
    const int steps = std::max(1, static_cast<int>(way.norm() / 0.2));
    for (int step = 0; step < steps; ++step) {
      path_map.push_back(feet_map[i] + way * step / steps + Eigen::Vector3d(0, 0, 1));
    }
  }
  path_map.push_back(feet_map.back() + Eigen::Vector3d(0, 0, 1));
  return path_map;
}

const std::vector<Eigen::Vector3d> kUpTheStairs = {{8.0, 1.0, 0.0}, {1.5, 1.0, 0.0},
                                                   {1.5, 2.0, 0.0}, {1.5, 6.0, 3.0},
                                                   {1.5, 7.0, 3.0}, {8.0, 7.0, 3.0}};

PlaceGraph PlacesOfTwoStoreys(const std::vector<Eigen::Vector3d>& path_map,
                              const PlaceOptions& more = {}) {
  PlaceOptions options = more;
  options.floors_m = {0.0, 3.0};
  return ExtractPlaces(TwoStoreys(), path_map, options);
}

std::vector<Place> PlacesOn(PlaceKind kind, const PlaceGraph& graph) {
  std::vector<Place> places;
  for (const Place& place : graph.places) {
    if (place.kind == kind) places.push_back(place);
  }
  return places;
}

// Whether links lead from the place that is nearest to one point to the one nearest to another.
bool IsWayBetween(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                  const PlaceGraph& graph) {
  const auto nearest = [&](const Eigen::Vector3d& point_map) {
    size_t best = 0;
    for (size_t i = 0; i < graph.places.size(); ++i) {
      const auto distance_m = [&](size_t place) {
        return (graph.places[place].position_map - point_map).norm();
      };
      if (distance_m(i) < distance_m(best)) best = i;
    }
    return static_cast<int>(best);
  };
  DisjointSets sets(graph.places.size());
  for (const PlaceLink& link : graph.links) sets.Merge(link.from, link.to);
  return sets.Find(nearest(from_map)) == sets.Find(nearest(to_map));
}

TEST(LinkStoreys, JoinsFloorsByStairsThatTheRobotWent) {
  const PlaceGraph graph = PlacesOfTwoStoreys(PathOver(kUpTheStairs));
  EXPECT_TRUE(IsWayBetween({8, 4, 0}, {8, 4, 3}, graph));
  const std::vector<Place> stairs = PlacesOn(PlaceKind::kStairs, graph);
  ASSERT_GE(stairs.size(), 3u);
  for (const Place& place : stairs) {
    EXPECT_EQ(place.floor_z_m, place.position_map.z() < 1.5 ? 0.0 : 3.0);
    EXPECT_NEAR(place.position_map.x(), 1.5, 0.2);
    EXPECT_EQ(place.clearance_m, PlaceOptions().robot_radius_m);
  }
  for (const PlaceLink& link : graph.links) {
    const Eigen::Vector3d way = graph.places[static_cast<size_t>(link.to)].position_map -
                                graph.places[static_cast<size_t>(link.from)].position_map;
    EXPECT_LE(std::abs(way.z()), 2.0);
    EXPECT_LT(link.from, link.to);
  }
}

TEST(LinkStoreys, DoesNotJoinFloorsByAStairwellThatWasOnlySeen) {
  // The robot was on both floors, and nobody knows how it came up.
  std::vector<Eigen::Vector3d> path_map = PathOver({{8, 1, 0}, {1.5, 1, 0}});
  for (const Eigen::Vector3d& point : PathOver({{8, 7, 3}, {6, 7, 3}})) path_map.push_back(point);
  const PlaceGraph graph = PlacesOfTwoStoreys(path_map);
  EXPECT_FALSE(IsWayBetween({8, 4, 0}, {8, 4, 3}, graph));
  EXPECT_EQ(PlacesOn(PlaceKind::kFloor, graph).size(), graph.places.size());
}

TEST(LinkStoreys, TellsAWayOnceHoweverOftenItWasGone) {
  std::vector<Eigen::Vector3d> feet_map = kUpTheStairs;
  const size_t once = PlacesOn(PlaceKind::kStairs, PlacesOfTwoStoreys(PathOver(feet_map))).size();
  feet_map.insert(feet_map.end(), kUpTheStairs.rbegin(), kUpTheStairs.rend());
  EXPECT_EQ(PlacesOn(PlaceKind::kStairs, PlacesOfTwoStoreys(PathOver(feet_map))).size(), once);
}

TEST(LinkStoreys, ForgetsAWayThatWasBegunAndNotEnded) {
  const PlaceGraph graph = PlacesOfTwoStoreys(
      PathOver({{8, 1, 0}, {1.5, 1, 0}, {1.5, 2, 0}, {1.5, 4, 1.5}, {1.5, 2, 0}, {8, 1, 0}}));
  EXPECT_EQ(PlacesOn(PlaceKind::kFloor, graph).size(), graph.places.size());
}

TEST(LinkStoreys, KnowsLiftsAndRampsFromStairs) {
  // A cabin of which only the begin and the end of the ride were seen.
  std::vector<Eigen::Vector3d> path_map = PathOver({{4, 1, 0}, {8, 4, 0}});
  for (const Eigen::Vector3d& point : PathOver({{8, 4, 3}, {4, 7, 3}})) path_map.push_back(point);
  const PlaceGraph lift = PlacesOfTwoStoreys(path_map);
  EXPECT_TRUE(IsWayBetween({4, 1, 0}, {4, 7, 3}, lift));
  EXPECT_GE(PlacesOn(PlaceKind::kLift, lift).size(), 2u);
  PlaceOptions options;
  options.ramp_slope = 1.0;
  const PlaceGraph ramp = PlacesOfTwoStoreys(PathOver(kUpTheStairs), options);
  EXPECT_FALSE(PlacesOn(PlaceKind::kRamp, ramp).empty());
  options = {};
  options.lift_run_m = 9.0;
  EXPECT_FALSE(
      PlacesOn(PlaceKind::kLift, PlacesOfTwoStoreys(PathOver(kUpTheStairs), options)).empty());
}

TEST(LinkStoreys, ForgivesHeightsThatAreALittleOff) {
  std::vector<Eigen::Vector3d> feet_map = kUpTheStairs;
  for (Eigen::Vector3d& point : feet_map) point.z() *= 1.06;
  PlaceOptions options;
  EXPECT_TRUE(IsWayBetween({8, 4, 0}, {8, 4, 3}, PlacesOfTwoStoreys(PathOver(feet_map), options)));
  options.landing_m = 0.05;
  EXPECT_FALSE(IsWayBetween({8, 4, 0}, {8, 4, 3}, PlacesOfTwoStoreys(PathOver(feet_map), options)));
}

}  // namespace
}  // namespace dsg::ingest
