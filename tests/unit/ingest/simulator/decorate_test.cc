// SPDX-License-Identifier: Apache-2.0
// What hangs on walls hangs on walls, and changes nothing for those who walk.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "ingest/simulator/world/world.h"

namespace dsg::simulator {
namespace {

bool Hangs(const Furniture& item) { return item.on < 0 && !item.StandsOnFloor(); }

TEST(Decorate, HangsPiecesOnWallsThatReachTheFloorAndNotOnGlass) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment}) {
    const World world = *GenerateWorld({kind, 5});
    int count = 0;
    for (const Furniture& item : world.furniture) {
      if (!Hangs(item)) continue;
      ++count;
      EXPECT_GE(item.BaseM(), 0.9 - 1e-9) << item.name;
      // Behind it is a wall, all along.
      const Rect footprint = item.Footprint();
      const double angle = 0.5 * 3.14159265358979 * item.quarter_turns;
      const Point front(-std::sin(angle), std::cos(angle));
      Rect behind = footprint;
      behind.translate(-0.05 * front);
      const bool has_wall = std::any_of(
          world.plan.structures.begin(), world.plan.structures.end(), [&](const Structure& part) {
            const bool faces_room = part.normal.head<2>().dot(front) > 0.9;
            return part.room == item.room && part.type == "wall" && part.z_min_m == 0.0 &&
                   faces_room && Inflate(part.rect, 0.03).contains(behind);
          });
      EXPECT_TRUE(has_wall) << item.name << " of room " << item.room;
    }
    EXPECT_GT(count, 3) << Name(kind);
  }
}

TEST(Decorate, KeepsWhatItAddsOutOfFreeSpace) {
  const World world = *GenerateWorld({WorldKind::kOffice, 6});
  size_t standing = 0;
  for (const Furniture& item : world.furniture) standing += item.StandsOnFloor() ? 1 : 0;
  for (const Structure& part : world.plan.structures) standing += part.IsObstacle() ? 1 : 0;
  EXPECT_EQ(world.free_space.obstacles().size(), standing);
}

TEST(Decorate, PutsBottlesAndPhonesOnTables) {
  const World world = *GenerateWorld({WorldKind::kOffice, 7});
  int count = 0;
  for (const Furniture& item : world.furniture) {
    if (item.class_name != "bottle" && item.class_name != "phone") continue;
    ASSERT_GE(item.on, 0) << item.name;
    EXPECT_EQ(world.furniture[static_cast<size_t>(item.on)].room, item.room);
    ++count;
  }
  EXPECT_GT(count, 20);
}

}  // namespace
}  // namespace dsg::simulator
