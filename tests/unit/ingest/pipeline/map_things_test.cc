// SPDX-License-Identifier: Apache-2.0
// The small steps between the stages of a map.
#include "ingest/pipeline/map_things.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

const std::vector<SemanticLabel> kThingLabels = {
    {1, "wall"}, {2, "floor"}, {4, "glass"}, {11, "Chair"}, {90, "human"}};

StructurePiece Level(const char* type, double z, double width) {
  StructurePiece piece;
  piece.type = type;
  piece.normal_map = Eigen::Vector3d::UnitZ() * (std::string(type) == "floor" ? 1.0 : -1.0);
  piece.offset_m = -z * piece.normal_map.z();
  piece.box_map = Box3d(Eigen::Vector3d(0, 0, z), Eigen::Vector3d(width, 5, z));
  piece.area_m2 = 5.0 * width;
  return piece;
}

TEST(MapThings, ObjectsAreNeitherStructuresNorPeople) {
  const std::vector<int32_t> people = DynamicClasses(kThingLabels);
  EXPECT_EQ(people, std::vector<int32_t>{90});
  EXPECT_EQ(ObjectClasses(kThingLabels, StructureClasses::FromLabels(kThingLabels), people),
            std::vector<int32_t>{11});
  EXPECT_EQ(ObjectClasses({}, {}, {}), std::vector<int32_t>{kThingClass});
  EXPECT_EQ(NamesOf({})[0].name, kThingName);
}

TEST(MapThings, FloorsAreApartAndUnderTheRobot) {
  const std::vector<StructurePiece> pieces = {Level("floor", 0.0, 10), Level("floor", 0.8, 4),
                                              Level("floor", 3.0, 8), Level("floor", 6.0, 9)};
  EXPECT_EQ(FloorsOf(pieces, {{1, 1, 1.2}, {1, 1, 4.2}}, {}, {}), (std::vector<double>{0.0, 3.0}));
  EXPECT_TRUE(FloorsOf(pieces, {}, {}, {}).empty());
}

TEST(MapThings, TheCeilingIsTheLargestWithinReach) {
  const std::vector<StructurePiece> pieces = {Level("ceiling", 2.7, 4), Level("ceiling", 3.0, 9),
                                              Level("ceiling", 9.0, 20)};
  EXPECT_DOUBLE_EQ(CeilingAbove(pieces, 0.0, {}, {}).value(), 3.0);
  EXPECT_FALSE(CeilingAbove(pieces, 2.5, {}, {}).has_value());
}

TEST(MapThings, WhatHangsStandsOnNoFloor) {
  ObjectCluster object;
  object.map_T_box.position.z() = 3.5;
  object.size.z() = 0.9;
  EXPECT_DOUBLE_EQ(FloorUnder(object, {0.0, 3.0}, {}).value(), 3.0);
  object.map_T_box.position.z() = 2.0;
  EXPECT_FALSE(FloorUnder(object, {0.0, 3.0}, {}).has_value());
}

TEST(MapThings, GlassClosesItsColumnsAndNoOthers) {
  OccupancyGrid grid;
  grid.frame.size = {10, 10, 30};
  grid.cells.assign(static_cast<size_t>(grid.frame.CellCount()), Occupancy::kFree);
  MeshBlock block;
  // The bottom rail of a pane, and a wall.
  block.positions_map = {{0.55f, 0.55f, 0.05f}, {0.25f, 0.25f, 0.05f}};
  block.labels = {4, 1};
  CloseGlass({&block}, GlassClasses(kThingLabels), {0.0}, 1.8, {}, &grid);
  EXPECT_EQ(grid.AtPoint({0.55, 0.55, 0.05}), Occupancy::kOccupied);
  EXPECT_EQ(grid.AtPoint({0.55, 0.55, 1.75}), Occupancy::kOccupied);
  EXPECT_EQ(grid.AtPoint({0.55, 0.55, 2.5}), Occupancy::kFree);
  EXPECT_EQ(grid.AtPoint({0.25, 0.25, 1.0}), Occupancy::kFree);
}

TEST(MapThings, ObjectsBehindAWallAreNotInView) {
  DepthFrame frame;
  frame.camera.width = frame.camera.height = 11;
  frame.camera.fx = frame.camera.fy = 10.0;
  frame.camera.cx = frame.camera.cy = 5.0;
  frame.depth_m.assign(121, 3.0f);
  TrackedObject object;
  object.id = 7;
  object.cluster.size = {0.4, 0.4, 0.4};
  object.cluster.center_map = {0.0, 0.0, 3.1};
  EXPECT_EQ(ObjectsInView({object}, frame, {}), std::vector<int64_t>{7});
  object.cluster.center_map.z() = 6.0;
  EXPECT_TRUE(ObjectsInView({object}, frame, {}).empty());
  object.cluster.center_map.z() = -3.0;
  EXPECT_TRUE(ObjectsInView({object}, frame, {}).empty());
}

TEST(MapThings, AspectIsOfTheTurnedRectangle) {
  EXPECT_NEAR(AspectOf({{0, 0}, {4, 4}, {3, 5}, {-1, 1}}), 4.0, 1e-9);
  EXPECT_DOUBLE_EQ(AspectOf({}), 1.0);
}

}  // namespace
}  // namespace dsg::ingest
