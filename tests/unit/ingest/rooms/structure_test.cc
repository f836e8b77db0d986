// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/structure.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "ingest/rooms/structure_rooms.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr uint32_t kWall = 1;
constexpr uint32_t kFloor = 2;
constexpr uint32_t kCeiling = 3;
constexpr uint32_t kPillar = 5;

StructureClasses Classes() {
  return StructureClasses::FromLabels(
      {{1, "wall"}, {2, "floor"}, {3, "ceiling"}, {4, "glass"}, {5, "pillar"}, {10, "desk"}});
}

/// A rectangle of small faces, seen from where u x v points to.
void AddSheet(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
              uint32_t label, MeshBlock* mesh, double step_m = 0.1, double noise_m = 0.0) {
  static Random random(7, 0);
  const int nu = std::max(1, static_cast<int>(std::lround(u.norm() / step_m)));
  const int nv = std::max(1, static_cast<int>(std::lround(v.norm() / step_m)));
  const Eigen::Vector3d normal = u.cross(v).normalized();
  const auto first = static_cast<uint32_t>(mesh->positions_map.size());
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const Eigen::Vector3d at =
          corner + u * i / nu + v * j / nv + noise_m * random.Normal() * normal;
      mesh->positions_map.push_back(at.cast<float>());
      mesh->labels.push_back(label);
    }
  }
  const auto row = static_cast<uint32_t>(nu + 1);
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const uint32_t a = first + static_cast<uint32_t>(j) * row + static_cast<uint32_t>(i);
      mesh->faces.push_back({a, a + 1, a + row + 1});
      mesh->faces.push_back({a, a + row + 1, a + row});
    }
  }
}

/// The inside of a box; five metres by four.
MeshBlock BoxRoom(double noise_m = 0.0, double step_m = 0.1) {
  const Eigen::Vector3d x(5, 0, 0);
  const Eigen::Vector3d y(0, 4, 0);
  const Eigen::Vector3d z(0, 0, 2.5);
  MeshBlock mesh;
  AddSheet({0, 0, 0}, x, y, kFloor, &mesh, step_m, noise_m);
  AddSheet({0, 0, 2.5}, y, x, kCeiling, &mesh, step_m, noise_m);
  AddSheet({0, 0, 0}, z, x, kWall, &mesh, step_m, noise_m);
  AddSheet({0, 4, 0}, x, z, kWall, &mesh, step_m, noise_m);
  AddSheet({0, 0, 0}, y, z, kWall, &mesh, step_m, noise_m);
  AddSheet({5, 0, 0}, z, y, kWall, &mesh, step_m, noise_m);
  return mesh;
}

int CountOf(const std::vector<StructurePiece>& pieces, const std::string& type) {
  int count = 0;
  for (const StructurePiece& piece : pieces) count += piece.type == type ? 1 : 0;
  return count;
}

TEST(StructureClasses, AreToldByName) {
  const StructureClasses classes = Classes();
  EXPECT_EQ(classes.wall, (std::vector<int32_t>{1, 4}));
  EXPECT_EQ(classes.floor, (std::vector<int32_t>{2}));
  EXPECT_EQ(classes.ceiling, (std::vector<int32_t>{3}));
  EXPECT_EQ(classes.pillar, (std::vector<int32_t>{5}));
  EXPECT_TRUE(classes.IsStructure(4));
  EXPECT_FALSE(classes.IsStructure(10));
}

TEST(StructureClasses, AreToldFromTheTablesOfOtherDataSets) {
  const StructureClasses nyu = StructureClasses::FromLabels({{1, "wall"},
                                                             {2, "floor"},
                                                             {8, "door"},
                                                             {9, "window"},
                                                             {20, "floor mat"},
                                                             {22, "Ceiling"},
                                                             {38, "otherstructure"}});
  EXPECT_EQ(nyu.wall, (std::vector<int32_t>{1, 9}));
  EXPECT_EQ(nyu.floor, (std::vector<int32_t>{2}));
  EXPECT_EQ(nyu.ceiling, (std::vector<int32_t>{22}));
  // Many names share an id.
  const StructureClasses tesse = StructureClasses::FromLabels({{3, "Floor_10x10"},
                                                               {3, "Carpet_End"},
                                                               {3, "Floor_3x3"},
                                                               {17, "TableScreen_A"},
                                                               {17, "TableScreen_B"},
                                                               {17, "TableScreen_C_Glass"},
                                                               {19, "W_1x"},
                                                               {19, "W_6x_Door"},
                                                               {19, "Elevator"},
                                                               {4, "CeilingHang01"},
                                                               {4, "CeilingLamp"},
                                                               {4, "Lamp_SquareCeiling"},
                                                               {20, "Walls_Kitchen"}});
  EXPECT_EQ(tesse.floor, (std::vector<int32_t>{3}));
  EXPECT_EQ(tesse.wall, (std::vector<int32_t>{19, 20}));
  EXPECT_EQ(tesse.ceiling, (std::vector<int32_t>{4}));
}

TEST(Structures, OfABoxAreItsSixSides) {
  const MeshBlock room = BoxRoom();
  const std::vector<StructurePiece> pieces = FindStructures({&room}, Classes(), {});
  ASSERT_EQ(pieces.size(), 6u);
  EXPECT_EQ(CountOf(pieces, "wall"), 4);
  EXPECT_EQ(pieces[0].type, "floor");
  // Its edges belong to whichever side came first.
  EXPECT_NEAR(pieces[0].area_m2, 20.0, 1.0);
  EXPECT_GT(pieces[0].normal_map.z(), 0.999);
  for (const StructurePiece& piece : pieces) {
    // All face the middle.
    EXPECT_GT(piece.normal_map.dot(Eigen::Vector3d(2.5, 2.0, 1.25)) + piece.offset_m, 1.0);
  }
}

TEST(Structures, AreWholeAcrossBlocks) {
  for (const double noise_m : {0.0, 0.003}) {
    const std::vector<MeshBlock> blocks = SplitIntoBlocks(BoxRoom(noise_m), 1.0);
    ASSERT_GT(blocks.size(), 20u);
    std::vector<const MeshBlock*> mesh;
    for (const MeshBlock& block : blocks) mesh.push_back(&block);
    EXPECT_EQ(FindStructures(mesh, Classes(), {}).size(), 6u) << noise_m;
  }
}

TEST(Structures, WithoutLabelsAreToldByNormalsAndHeight) {
  MeshBlock room = BoxRoom();
  // A table top, and a picture's worth of an upright face.
  AddSheet({1, 1, 0.75}, {1.5, 0, 0}, {0, 1.5, 0}, 10, &room);
  AddSheet({1, 1, 0.0}, {1.5, 0, 0}, {0, 0, 0.7}, 10, &room);
  room.labels.clear();
  const std::vector<StructurePiece> pieces = FindStructures({&room}, {}, {});
  EXPECT_EQ(CountOf(pieces, "floor"), 1);
  EXPECT_EQ(CountOf(pieces, "ceiling"), 1);
  EXPECT_EQ(CountOf(pieces, "wall"), 4);
}

TEST(Structures, JoinAWallThatFurnitureHidesAPartOf) {
  MeshBlock mesh;
  AddSheet({0, 0, 0}, {2, 0, 0}, {0, 0, 2.5}, kWall, &mesh);
  AddSheet({2.3, 0, 0}, {2, 0, 0}, {0, 0, 2.5}, kWall, &mesh);
  // In one plane, but another wall: a room's width away.
  AddSheet({8.0, 0, 0}, {2, 0, 0}, {0, 0, 2.5}, kWall, &mesh);
  const std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_NEAR(pieces[0].area_m2, 10.0, 0.1);
}

TEST(Structures, WhatLiesFlatIsNoWallWhateverItsLabel) {
  MeshBlock mesh;
  AddSheet({0, 0, 0}, {1, 0, 0}, {0, 5, 0}, kWall, &mesh);
  AddSheet({0, 0, 0}, {0, 0, 2.5}, {5, 0, 0}, kWall, &mesh);
  // Of an attic.
  AddSheet({0, 6, 0}, {0, 1.2, 2}, {5, 0, 0}, kWall, &mesh);
  const std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  ASSERT_EQ(pieces.size(), 2u);
  for (const StructurePiece& piece : pieces) EXPECT_LT(std::abs(piece.normal_map.z()), 0.6);
}

TEST(Structures, HaveOnePieceAPillar) {
  MeshBlock mesh;
  for (const double x : {0.0, 3.0}) {
    AddSheet({x, 0, 0}, {0.4, 0, 0}, {0, 0, 2.5}, kPillar, &mesh);
    AddSheet({x + 0.4, 0, 0}, {0, 0.4, 0}, {0, 0, 2.5}, kPillar, &mesh);
  }
  const std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].type, "pillar");
  EXPECT_TRUE(pieces[0].normal_map.isZero());
}

TEST(Structures, OfNothingOrOfBrokenBlocksAreNone) {
  EXPECT_TRUE(FindStructures({}, Classes(), {}).empty());
  MeshBlock broken;
  broken.positions_map = {{0, 0, 0}, {NAN, 0, 0}, {0, 1, 0}};
  broken.labels = {1};
  broken.faces = {{{0, 1, 2}}, {{0, 2, 9}}, {{0, 0, 0}}};
  EXPECT_TRUE(FindStructures({&broken, nullptr}, Classes(), {}).empty());
}

TEST(Structures, OfAMillionVerticesAreStillTheSixSides) {
  const MeshBlock room = BoxRoom(0.002, 0.0095);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<StructurePiece> pieces = FindStructures({&room}, Classes(), {});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf("%zu vertices, %zu pieces, %.2f s\n", room.positions_map.size(), pieces.size(),
              took.count());
  EXPECT_EQ(pieces.size(), 6u);
}

TEST(StructureTracker, KeepsIdsWhileWallsGrow) {
  StructureTracker tracker;
  MeshBlock mesh;
  AddSheet({0, 0, 0}, {2, 0, 0}, {0, 0, 2.5}, kWall, &mesh);
  AddSheet({0, 3, 0}, {0, 0, 2.5}, {2, 0, 0}, kWall, &mesh);
  std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  tracker.Track(&pieces);
  ASSERT_EQ(pieces.size(), 2u);
  MeshBlock more;
  AddSheet({0, 3, 0}, {0, 0, 2.5}, {6, 0, 0}, kWall, &more);
  AddSheet({0, 0, 0}, {3, 0, 0}, {0, 0, 2.5}, kWall, &more);
  AddSheet({0, 0, 0}, {0, 3, 0}, {0, 0, 2.5}, kWall, &more);
  std::vector<StructurePiece> grown = FindStructures({&more}, Classes(), {});
  tracker.Track(&grown);
  ASSERT_EQ(grown.size(), 3u);
  for (const StructurePiece& piece : grown) {
    const auto same = std::find_if(pieces.begin(), pieces.end(), [&](const auto& old) {
      return old.normal_map.dot(piece.normal_map) > 0.99;
    });
    EXPECT_EQ(piece.id, same == pieces.end() ? 2 : same->id);
  }
}

TEST(StructureHeights, AddUpWhatIsLevel) {
  std::vector<StructurePiece> pieces(4);
  const double heights_m[] = {2.70, 3.0, 2.74, 0.0};
  const double areas_m2[] = {10.0, 15.0, 9.0, 50.0};
  for (size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].type = i < 3 ? "ceiling" : "floor";
    pieces[i].area_m2 = areas_m2[i];
    pieces[i].box_map.extend(Eigen::Vector3d(0, 0, heights_m[i]));
  }
  const std::vector<StructureHeight> ceilings = CeilingHeights(pieces, {});
  ASSERT_EQ(ceilings.size(), 2u);
  EXPECT_DOUBLE_EQ(ceilings[0].z_m, 2.70);
  EXPECT_DOUBLE_EQ(ceilings[0].area_m2, 19.0);
  EXPECT_EQ(FloorHeights(pieces, {}).size(), 1u);
}

TEST(StructureRooms, AWallBoundsTheRoomItFaces) {
  MeshBlock mesh = BoxRoom();
  // The other side of the wall at x = 5, in the next room.
  AddSheet({5.15, 0, 0}, {0, 4, 0}, {0, 0, 2.5}, kWall, &mesh);
  const std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  ASSERT_EQ(pieces.size(), 7u);
  std::vector<FoundRoom> rooms(2);
  rooms[0].footprint_map = {{0, 0}, {5, 0}, {5, 4}, {0, 4}};
  rooms[1].footprint_map = {{5.15, 0}, {9, 0}, {9, 4}, {5.15, 4}};
  for (FoundRoom& room : rooms) room.z_max_m = 2.5;
  int of_first = 0;
  int of_second = 0;
  for (const auto& [piece, room] : EnclosesOf(pieces, rooms, {})) {
    of_first += room == 0 ? 1 : 0;
    of_second += room == 1 ? 1 : 0;
    if (room == 1) {
      EXPECT_NEAR(pieces[static_cast<size_t>(piece)].box_map.min().x(), 5.15, 0.01);
    }
  }
  EXPECT_EQ(of_first, 6);
  EXPECT_EQ(of_second, 1);
}

std::optional<int> OfBox(const Box3d& box, const std::vector<StructurePiece>& pieces) {
  return AttachedTo({box.center(), Eigen::Quaterniond::Identity()}, box.sizes(), pieces, {});
}

TEST(StructureRooms, AThingHangsOnTheWallThatItTouches) {
  const MeshBlock mesh = BoxRoom();
  const std::vector<StructurePiece> pieces = FindStructures({&mesh}, Classes(), {});
  const Box3d board(Eigen::Vector3d(1.0, 0.02, 0.9), Eigen::Vector3d(2.8, 0.06, 2.1));
  const std::optional<int> wall = OfBox(board, pieces);
  ASSERT_TRUE(wall.has_value());
  EXPECT_GT(pieces[static_cast<size_t>(*wall)].normal_map.y(), 0.99);
  const Box3d lamp(Eigen::Vector3d(2.0, 2.0, 1.5), Eigen::Vector3d(2.2, 2.2, 1.7));
  EXPECT_FALSE(OfBox(lamp, pieces).has_value());
}

TEST(StructureRooms, APictureHangsOnAWallThatLiesAskew) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  StructurePiece wall;
  wall.type = "wall";
  wall.normal_map = turn * Eigen::Vector3d::UnitY();
  wall.box_map = TransformBox({Eigen::Vector3d::Zero(), turn},
                              Box3d(Eigen::Vector3d(-3, -0.05, 0), Eigen::Vector3d(3, 0.05, 2.5)));
  const Eigen::Vector3d size(1.2, 0.03, 0.8);
  const auto piece_at = [&](double from_wall_m) {
    const Eigen::Vector3d at = turn * Eigen::Vector3d(0.5, from_wall_m, 1.6);
    return AttachedTo({at, turn}, size, {wall}, {});
  };
  EXPECT_EQ(piece_at(0.05), 0);
  EXPECT_FALSE(piece_at(0.4).has_value());
}

TEST(StructureRooms, AThingHangsOnACeilingAndOnAPillarToo) {
  StructurePiece ceiling;
  ceiling.type = "ceiling";
  ceiling.box_map = Box3d(Eigen::Vector3d(0, 0, 2.5), Eigen::Vector3d(4, 4, 2.52));
  StructurePiece pillar;
  pillar.type = "pillar";
  pillar.box_map = Box3d(Eigen::Vector3d(2, 2, 0), Eigen::Vector3d(2.4, 2.4, 2.5));
  StructurePiece floor = ceiling;
  floor.type = "floor";
  const std::vector<StructurePiece> pieces = {floor, ceiling, pillar};
  const Box3d lamp(Eigen::Vector3d(1.0, 1.0, 2.1), Eigen::Vector3d(1.3, 1.3, 2.48));
  EXPECT_EQ(OfBox(lamp, pieces), 1);
  const Box3d hanging_low(Eigen::Vector3d(1.0, 1.0, 1.8), Eigen::Vector3d(1.3, 1.3, 2.2));
  EXPECT_FALSE(OfBox(hanging_low, pieces).has_value());
  const Box3d clock(Eigen::Vector3d(2.1, 1.95, 1.6), Eigen::Vector3d(2.3, 2.0, 1.8));
  EXPECT_EQ(OfBox(clock, pieces), 2);
}

}  // namespace
}  // namespace dsg::ingest
