// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/extract_places.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <string>
#include <variant>

#include "ingest/grid/distance_field.h"
#include "schema/base/disjoint_sets.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/config/other_value.h"
#include "tests/unit/ingest/places/plan_map.h"

namespace dsg::ingest {
namespace {

using Point = Eigen::Vector3d;
using Path = std::vector<Point>;

constexpr Occupancy kWall = Occupancy::kOccupied;

PlaceOptions OnGround() {
  PlaceOptions options;
  options.floors_m = {0.0};
  return options;
}

PlaceOptions InTheAir() {
  PlaceOptions options = OnGround();
  options.mode = PlaceMode::kVolume;
  return options;
}

// 8 m x 4 m, walls all around, a wall across at x = 4 m with a door of `door_m` at y = 2 m.
OccupancyGrid TwoRooms(double door_m) {
  OccupancyGrid grid = MakeHall({8.0, 4.0, 2.6});
  Fill({0.0, 0.0, 0.0}, {8.0, 0.2, 3.0}, kWall, &grid);
  Fill({0.0, 3.8, 0.0}, {8.0, 4.0, 3.0}, kWall, &grid);
  Fill({0.0, 0.0, 0.0}, {0.2, 4.0, 3.0}, kWall, &grid);
  Fill({7.8, 0.0, 0.0}, {8.0, 4.0, 3.0}, kWall, &grid);
  Fill({3.9, 0.0, 0.0}, {4.1, 4.0, 3.0}, kWall, &grid);
  const double half_m = 0.5 * door_m;
  if (door_m > 0.0)
    Fill({3.9, 2.0 - half_m, 0.0}, {4.1, 2.0 + half_m, 2.1}, Occupancy::kFree, &grid);
  return grid;
}

// Parts of the graph that links join; places without links are parts of their own.
int CountParts(const PlaceGraph& graph) {
  DisjointSets sets(graph.places.size());
  int count = static_cast<int>(graph.places.size());
  for (const PlaceLink& link : graph.links) count -= sets.Merge(link.from, link.to) ? 1 : 0;
  return count;
}

// Every 2 cm of each link: free, and no obstacle's middle within the robot's radius.
void ExpectLinksFree(const PlaceGraph& graph, const OccupancyGrid& grid, double radius_m) {
  const DistanceField field(grid);
  for (const PlaceLink& link : graph.links) {
    ASSERT_LT(link.from, link.to);
    Point from = graph.places[static_cast<size_t>(link.from)].position_map;
    Point to = graph.places[static_cast<size_t>(link.to)].position_map;
    if (grid.frame.size.z() == 1) {
      from.z() = grid.frame.Center({0, 0, 0}).z();
      to.z() = from.z();
    }
    const int steps = 1 + static_cast<int>((to - from).norm() / 0.02);
    for (int step = 0; step <= steps; ++step) {
      const Point at = from + (to - from) * step / steps;
      ASSERT_EQ(grid.AtPoint(at), Occupancy::kFree) << at.transpose();
      const Eigen::Vector3i cell = grid.frame.CellOf(at);
      ASSERT_GT(field.DistanceM(grid.frame.Index(cell)), radius_m) << at.transpose();
    }
    ASSERT_GE(link.clearance_m, radius_m - 1e-6);
  }
}

double ShareInReach(const PlaceGraph& graph, const OccupancyGrid& flat) {
  const DistanceField field(flat);
  const double z = flat.frame.Center({0, 0, 0}).z();
  int in_reach = 0;
  int count = 0;
  for (int y = 0; y < flat.frame.size.y(); y += 2) {
    for (int x = 0; x < flat.frame.size.x(); x += 2) {
      const Point at = flat.frame.Center({x, y, 0});
      if (field.ClearanceM(at) < 0.25) continue;
      ++count;
      for (const Place& place : graph.places) {
        const Point to(place.position_map.x(), place.position_map.y(), z);
        if ((to - at).norm() > 3.0 || !field.HasClearance(at, to, 0.15)) continue;
        ++in_reach;
        break;
      }
    }
  }
  return count == 0 ? 1.0 : static_cast<double>(in_reach) / count;
}

TEST(ExtractPlaces, PassesADoorOfNinetyCentimetres) {
  const OccupancyGrid grid = TwoRooms(0.9);
  const PlaceGraph graph = ExtractPlaces(grid, {}, OnGround());
  EXPECT_GE(graph.places.size(), 6u);
  EXPECT_EQ(CountParts(graph), 1);
  ExpectLinksFree(graph, ProjectToFloor(grid, 0.0, OnGround()), 0.25);
}

TEST(ExtractPlaces, DoesNotPassAGapThatIsNarrowerThanTheRobot) {
  EXPECT_EQ(CountParts(ExtractPlaces(TwoRooms(0.4), {}, OnGround())), 2);
  EXPECT_EQ(CountParts(ExtractPlaces(TwoRooms(0.0), {}, OnGround())), 2);
}

TEST(ExtractPlaces, DoesNotGoThroughWhatWasNeverSeen) {
  OccupancyGrid grid = TwoRooms(0.9);
  Fill({4.5, 0.0, 0.0}, {5.5, 4.0, 3.0}, Occupancy::kUnknown, &grid);
  const PlaceGraph graph = ExtractPlaces(grid, {}, OnGround());
  EXPECT_EQ(CountParts(graph), 2);
  for (const Place& place : graph.places) {
    const double x = place.position_map.x();
    EXPECT_TRUE(x < 4.5 || x > 5.5) << x;
  }
}

TEST(ExtractPlaces, LeavesOutWhatTheRobotCannotHaveReached) {
  const Path path = {{1.0, 1.0, 1.2}, {2.0, 2.0, 1.2}};
  const PlaceGraph graph = ExtractPlaces(TwoRooms(0.0), path, OnGround());
  EXPECT_FALSE(graph.places.empty());
  for (const Place& place : graph.places) EXPECT_LT(place.position_map.x(), 4.0);
}

TEST(ExtractPlaces, BelievesTheRobotWhereItHasBeen) {
  OccupancyGrid grid = TwoRooms(0.9);
  // The trace of somebody who stood in the door.
  Fill({3.8, 1.9, 0.0}, {4.0, 2.1, 1.7}, kWall, &grid);
  EXPECT_EQ(CountParts(ExtractPlaces(grid, {}, OnGround())), 2);
  Path path;
  for (double x = 1.0; x < 7.0; x += 0.05) path.emplace_back(x, 2.0, 1.2);
  EXPECT_EQ(CountParts(ExtractPlaces(grid, path, OnGround())), 1);
}

TEST(ExtractPlaces, DoesNotDriveOverATableThatACameraPassed) {
  OccupancyGrid grid = TwoRooms(0.9);
  Fill({1.0, 1.0, 0.6}, {2.5, 3.0, 0.8}, kWall, &grid);
  Path path;
  for (double x = 0.6; x < 7.0; x += 0.05) path.emplace_back(x, 2.0, 1.3 + 0.3 * std::sin(9.0 * x));
  const PlaceGraph graph = ExtractPlaces(grid, path, OnGround());
  ExpectLinksFree(graph, ProjectToFloor(grid, 0.0, OnGround()), 0.25);
  path.clear();
  for (double x = 0.6; x < 7.0; x += 0.05) path.emplace_back(x, 2.0, 1.2);
  for (const Place& place : ExtractPlaces(grid, path, OnGround()).places) {
    const Point& at = place.position_map;
    EXPECT_FALSE(at.x() > 1.4 && at.x() < 2.1 && at.y() > 1.4 && at.y() < 2.6) << at.transpose();
  }
}

TEST(ExtractPlaces, CoversACorridorAndAHallOfPillarsAndARoomFullOfTables) {
  OccupancyGrid hall = MakeHall({16.0, 12.0, 2.6});
  for (double x = 3.0; x < 16.0; x += 3.0) {
    for (double y = 3.0; y < 12.0; y += 3.0) {
      Fill({x, y, 0.0}, {x + 0.4, y + 0.4, 3.0}, kWall, &hall);
    }
  }
  OccupancyGrid tables = TwoRooms(0.9);
  Fill({0.9, 0.9, 0.6}, {2.1, 1.7, 0.8}, kWall, &tables);
  Fill({0.9, 2.5, 0.6}, {2.1, 3.1, 0.8}, kWall, &tables);
  Fill({4.9, 0.9, 0.6}, {6.9, 3.1, 0.8}, kWall, &tables);
  OccupancyGrid corridor = MakeHall({20.0, 1.4, 2.6});
  for (const OccupancyGrid* grid : {&hall, &tables, &corridor}) {
    const PlaceGraph graph = ExtractPlaces(*grid, {}, OnGround());
    const OccupancyGrid flat = ProjectToFloor(*grid, 0.0, OnGround());
    EXPECT_GE(ShareInReach(graph, flat), 0.995);
    EXPECT_EQ(CountParts(graph), 1);
    ExpectLinksFree(graph, flat, 0.25);
  }
}

TEST(ExtractPlaces, TellsOfAPlaceWhatIsAroundIt) {
  const PlaceGraph graph = ExtractPlaces(TwoRooms(0.9), {}, OnGround());
  bool has_basis = false;
  for (const Place& place : graph.places) {
    EXPECT_EQ(place.id, -1);
    EXPECT_EQ(place.position_map.z(), 0.0);
    EXPECT_EQ(place.floor_z_m, 0.0);
    EXPECT_GE(place.clearance_m, 0.1);
    EXPECT_LE(place.clearance_m, 1.9);
    EXPECT_TRUE(place.free_box.contains(Point(0.0, 0.0, 1.0)));
    EXPECT_NEAR(place.free_box.max().z(), 1.8, 1e-9);
    Box3d box_map = place.free_box;
    box_map.translate(place.position_map);
    EXPECT_TRUE(Box3d(Point(0.19, 0.19, -0.01), Point(7.81, 3.81, 2.0)).contains(box_map));
    has_basis = has_basis || place.basis_point_count >= 2;
  }
  EXPECT_TRUE(has_basis);
}

TEST(ExtractPlaces, FindsPlacesInTheAirToo) {
  const OccupancyGrid grid = TwoRooms(0.9);
  const PlaceGraph graph = ExtractPlaces(grid, {}, InTheAir());
  EXPECT_GE(graph.places.size(), 6u);
  EXPECT_EQ(CountParts(graph), 1);
  ExpectLinksFree(graph, grid, 0.25);
  for (const Place& place : graph.places) {
    EXPECT_GT(place.position_map.z(), 0.2);
    EXPECT_EQ(place.floor_z_m, 0.0);
    EXPECT_TRUE(place.free_box.contains(Point::Zero()));
  }
}

TEST(ExtractPlaces, NeverLinksThroughObstaclesOfRandomWorlds) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    OccupancyGrid grid = MakeHall({6.0, 5.0, 2.4});
    const int box_count = random.Integer(0, 25);
    for (int i = 0; i < box_count; ++i) {
      const Point low(random.Uniform(0.0, 6.0), random.Uniform(0.0, 5.0), random.Uniform(0.0, 2.0));
      const Point size(random.Uniform(0.1, 1.5), random.Uniform(0.1, 1.5),
                       random.Uniform(0.1, 2.0));
      Fill(low, low + size, random.Chance(0.8) ? kWall : Occupancy::kUnknown, &grid);
    }
    const PlaceGraph ground = ExtractPlaces(grid, {}, OnGround());
    const OccupancyGrid flat = ProjectToFloor(grid, 0.0, OnGround());
    ExpectLinksFree(ground, flat, 0.25);
    EXPECT_GE(ShareInReach(ground, flat), 0.95);
    ExpectLinksFree(ExtractPlaces(grid, {}, InTheAir()), grid, 0.25);
  }
}

TEST(ExtractPlaces, SaysTheSameTwice) {
  for (const PlaceOptions& options : {OnGround(), InTheAir()}) {
    const PlaceGraph a = ExtractPlaces(TwoRooms(0.9), {{1.0, 1.0, 1.2}}, options);
    const PlaceGraph b = ExtractPlaces(TwoRooms(0.9), {{1.0, 1.0, 1.2}}, options);
    ASSERT_EQ(a.places.size(), b.places.size());
    ASSERT_EQ(a.links.size(), b.links.size());
    for (size_t i = 0; i < a.places.size(); ++i) {
      EXPECT_EQ(a.places[i].position_map, b.places[i].position_map);
      EXPECT_EQ(a.places[i].clearance_m, b.places[i].clearance_m);
    }
    for (size_t i = 0; i < a.links.size(); ++i) {
      EXPECT_EQ(a.links[i].from, b.links[i].from);
      EXPECT_EQ(a.links[i].to, b.links[i].to);
      EXPECT_EQ(a.links[i].clearance_m, b.links[i].clearance_m);
    }
  }
}

TEST(ExtractPlaces, TakesNothingAndNonsenseWithoutACrash) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(ExtractPlaces({}, {}, OnGround()).places.empty());
  EXPECT_TRUE(ExtractPlaces({}, {{nan, 1e300, 0.0}}, InTheAir()).places.empty());
  OccupancyGrid one;
  one.frame.size = {1, 1, 1};
  one.cells = {Occupancy::kFree};
  EXPECT_LE(ExtractPlaces(one, {{0.0, 0.0, 0.0}}, OnGround()).places.size(), 1u);
  EXPECT_LE(ExtractPlaces(one, {{0.0, 0.0, 0.0}}, InTheAir()).places.size(), 1u);
  OccupancyGrid short_of_cells = TwoRooms(0.9);
  short_of_cells.cells.resize(10);
  EXPECT_TRUE(ExtractPlaces(short_of_cells, {}, OnGround()).places.empty());
  PlaceOptions options = OnGround();
  options.floors_m = {nan, 1e9, -1e9};
  EXPECT_TRUE(
      ExtractPlaces(TwoRooms(0.9), {{nan, nan, nan}, {1e300, 0.0, 0.0}}, options).places.empty());
  options = OnGround();
  options.robot_radius_m = nan;
  EXPECT_TRUE(ExtractPlaces(TwoRooms(0.9), {}, options).places.empty());
  options.robot_radius_m = 50.0;
  EXPECT_TRUE(ExtractPlaces(TwoRooms(0.9), {}, options).places.empty());
  options = OnGround();
  options.body_z_max_m = -3.0;
  EXPECT_TRUE(ExtractPlaces(TwoRooms(0.9), {}, options).places.empty());
  Random random(4, 0);
  OccupancyGrid noise = MakeHall({5.0, 5.0, 2.0});
  for (Occupancy& cell : noise.cells) cell = static_cast<Occupancy>(random.Index(3));
  ExtractPlaces(noise, {{2.0, 2.0, 1.0}}, OnGround());
  ExtractPlaces(noise, {{2.0, 2.0, 1.0}}, InTheAir());
}

TEST(ExtractPlaces, HasMorePlacesWhereTheyCoverLess) {
  const OccupancyGrid grid = TwoRooms(0.9);
  const size_t count = ExtractPlaces(grid, {}, OnGround()).places.size();
  PlaceOptions options = OnGround();
  options.near_reach_m = 0.3;
  options.reach_rise = 0.0;
  options.heir_m = 0.0;
  EXPECT_GT(ExtractPlaces(grid, {}, options).places.size(), count);
  options = OnGround();
  options.free_box_m = 0.5;
  for (const Place& place : ExtractPlaces(grid, {}, options).places) {
    EXPECT_LE(place.free_box.sizes().head<2>().maxCoeff(), 1.1 + 1e-6);
  }
}

TEST(PlaceOptions, KeepThePromisesAtBothEndsOfTheirRanges) {
  const OccupancyGrid grid = TwoRooms(0.9);
  PlaceOptions options = OnGround();
  for (const BoundOption& field : options.Bind()) {
    const double before = field.Get();
    for (const double value : {field.min, field.max}) {
      field.Set(value);
      SCOPED_TRACE(std::string(field.name) + " " + std::to_string(value));
      for (const PlaceMode mode : {PlaceMode::kGround, PlaceMode::kVolume}) {
        options.mode = mode;
        const PlaceGraph graph = ExtractPlaces(grid, {}, options);
        if (mode == PlaceMode::kVolume) continue;
        ExpectLinksFree(graph, ProjectToFloor(grid, 0.0, options), 0.25);
      }
    }
    field.Set(before);
  }
}

TEST(PlaceOptions, AreInRangeAndHaveNamesOfTheirOwn) {
  EXPECT_TRUE(ValidateOptions(PlaceOptions()).ok());
  PlaceOptions options;
  const std::vector<BoundOption> bound = options.Bind();
  std::set<std::string> names;
  std::set<std::variant<double*, int*, TimeNs*>> numbers;
  for (const BoundOption& field : bound) {
    names.insert(field.name);
    numbers.insert(field.value);
    const double before = field.Get();
    field.Set(field.max + 1.0);
    const absl::Status status = ValidateOptions(options);
    EXPECT_NE(status.message().find(field.name), std::string::npos) << field.name;
    field.Set(before);
    field.Set(OtherValue(field, bound));
    EXPECT_TRUE(ValidateOptions(options).ok()) << field.name;
    EXPECT_FALSE(DigestOptions(options).empty()) << field.name;
    field.Set(before);
  }
  EXPECT_EQ(names.size(), bound.size());
  EXPECT_EQ(numbers.size(), bound.size());
  // Each number has its row.
  const auto* const end = reinterpret_cast<const double*>(&options + 1);
  EXPECT_EQ(static_cast<ptrdiff_t>(bound.size()), end - &options.storey_m_min);
}

}  // namespace
}  // namespace dsg::ingest
