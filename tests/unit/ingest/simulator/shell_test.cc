// SPDX-License-Identifier: Apache-2.0
// Walls by hand: two rooms, one opening, different ceilings.
#include "ingest/simulator/world/shell.h"

#include <gtest/gtest.h>

#include <vector>

namespace dsg::simulator {
namespace {

/// A room 4 m x 3 m to the west of one 2 m x 3 m with a lower ceiling.
std::vector<Room> TwoRooms() {
  return {{"office", "west", Rect(Point(0, 0), Point(4, 3)), 3.0, false},
          {"office", "east", Rect(Point(4, 0), Point(6, 3)), 2.7, false}};
}

Door OpeningBetween(OpeningKind kind) { return {0, 1, Point(4.0, 1.5), 1.0, false, kind}; }

/// What stands on a spot of the wall between the rooms at a height, on the side of one of them.
std::vector<std::string> TypesAt(const std::vector<Structure>& structures, int room, double y,
                                 double z) {
  const Point at(room == 0 ? 4.0 - 0.5 * kHalfWallM : 4.0 + 0.5 * kHalfWallM, y);
  std::vector<std::string> types;
  for (const Structure& part : structures) {
    const bool is_here = part.room == room && part.rect.contains(at);
    if (is_here && part.z_min_m < z && z < part.z_max_m) types.push_back(part.type);
  }
  return types;
}

using Types = std::vector<std::string>;

TEST(Shell, LeavesADoorOpenUpToItsLintel) {
  const auto shell = DrawShell(TwoRooms(), {OpeningBetween(OpeningKind::kDoor)}, {}, {});
  for (const int room : {0, 1}) {
    EXPECT_EQ(TypesAt(shell, room, 1.5, 1.0), Types{});
    EXPECT_EQ(TypesAt(shell, room, 1.5, 2.5), Types{"wall"});
    EXPECT_EQ(TypesAt(shell, room, 0.5, 1.0), Types{"wall"});
    EXPECT_EQ(TypesAt(shell, room, 2.5, 1.0), Types{"wall"});
  }
}

TEST(Shell, OpensAFullHeightOpeningUpToTheLowerCeiling) {
  const auto shell = DrawShell(TwoRooms(), {OpeningBetween(OpeningKind::kFullHeight)}, {}, {});
  EXPECT_EQ(TypesAt(shell, 0, 1.5, 2.6), Types{});
  EXPECT_EQ(TypesAt(shell, 0, 1.5, 2.8), Types{"wall"});
  EXPECT_EQ(TypesAt(shell, 1, 1.5, 2.6), Types{});
  for (const Structure& part : shell) {
    EXPECT_GT(part.z_max_m, part.z_min_m);
    EXPECT_GT(part.rect.sizes().minCoeff(), 0.0);
  }
}

TEST(Shell, PutsGlassInBothHalvesOfAWall) {
  const GlassFront front = {0, 1, Rect(Point(4 - kHalfWallM, 2.2), Point(4 + kHalfWallM, 2.6))};
  const auto shell = DrawShell(TwoRooms(), {OpeningBetween(OpeningKind::kDoor)}, {front}, {});
  for (const int room : {0, 1}) {
    EXPECT_EQ(TypesAt(shell, room, 2.4, 1.0), Types{"glass"});
    EXPECT_EQ(TypesAt(shell, room, 2.4, 2.65), Types{"glass"});
    EXPECT_EQ(TypesAt(shell, room, 2.7, 1.0), Types{"wall"});
    EXPECT_EQ(TypesAt(shell, room, 2.1, 1.0), Types{"wall"});
    EXPECT_EQ(TypesAt(shell, room, 1.5, 1.0), Types{});
  }
}

TEST(Shell, StandsPillarsInTheirRooms) {
  const Pillar pillar = {0, Rect(Point(1.8, 1.3), Point(2.2, 1.7))};
  int count = 0;
  for (const Structure& part : DrawShell(TwoRooms(), {}, {}, {pillar})) {
    if (part.type != "pillar") continue;
    ++count;
    EXPECT_EQ(part.room, 0);
    EXPECT_EQ(part.z_max_m, 3.0);
    EXPECT_TRUE(part.IsObstacle());
    EXPECT_TRUE(part.normal.isZero());
  }
  EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace dsg::simulator
