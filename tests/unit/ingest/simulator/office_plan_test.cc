// SPDX-License-Identifier: Apache-2.0
// The 65 m x 65 m office: its size, its rooms, its openings, over many seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "ingest/simulator/world/floor_plan.h"
#include "ingest/simulator/world/partition.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kSeedCount = 100;

FloorPlan MakePlan(uint64_t seed) {
  Random random(seed, 1);
  return DrawOfficePlan(&random);
}

bool IsHall(const Room& room) {
  return room.class_name == "open office" || room.class_name == "lobby";
}

TEST(OfficePlan, IsSixtyFiveMetresSquareAndLeavesNothingOver) {
  for (uint64_t seed = 1; seed <= kSeedCount; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const FloorPlan plan = MakePlan(seed);
    double area = 0.0;
    Rect bounds;
    for (const Room& room : plan.rooms) {
      area += room.cell.volume();
      bounds.extend(room.cell);
    }
    EXPECT_NEAR(bounds.sizes().x(), 65.0, 0.01);
    EXPECT_NEAR(bounds.sizes().y(), 65.0, 0.01);
    EXPECT_NEAR(area, 65.0 * 65.0, 1e-6);
  }
}

TEST(OfficePlan, HasRoomsOfTheSizesItPromises) {
  for (uint64_t seed = 1; seed <= kSeedCount; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const FloorPlan plan = MakePlan(seed);
    int stay_count = 0;
    int hall_count = 0;
    std::map<std::string, int> classes;
    for (const Room& room : plan.rooms) {
      ++classes[room.class_name];
      const Point size = room.cell.sizes();
      EXPECT_EQ(room.is_passage, room.class_name == "corridor");
      if (room.is_passage) {
        EXPECT_GE(size.minCoeff(), 2.0 - 0.011);
        EXPECT_LE(size.minCoeff(), 2.4 + 0.011);
        EXPECT_EQ(room.ceiling_m, 3.0);
        continue;
      }
      ++stay_count;
      EXPECT_TRUE(room.ceiling_m == 3.0 || room.ceiling_m == 2.7);
      if (IsHall(room)) {
        ++hall_count;
        EXPECT_GE(room.cell.volume(), 100.0 - 1e-6);
        EXPECT_LE(room.cell.volume(), 420.0 + 1e-6);
        EXPECT_EQ(room.ceiling_m, 3.0);
        continue;
      }
      EXPECT_GE(room.cell.volume(), 12.0 - 1e-6);
      EXPECT_LE(room.cell.volume(), 60.0 + 1e-6);
      EXPECT_GE(size.minCoeff(), 3.2 - 1e-6);
    }
    EXPECT_GE(stay_count, 30);
    EXPECT_LE(stay_count, 50);
    EXPECT_GE(hall_count, 1);
    EXPECT_EQ(classes["lobby"], 1);
    EXPECT_GE(classes["office"], 8);
    EXPECT_GE(classes["meeting room"], 3);
    EXPECT_GE(classes["kitchen"], 1);
    EXPECT_GE(classes["lounge"], 1);
  }
}

TEST(OfficePlan, LeadsFromEveryRoomToACorridorOverAnotherRoomAtMost) {
  for (uint64_t seed = 1; seed <= kSeedCount; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const FloorPlan plan = MakePlan(seed);
    std::set<int> near;
    for (const Door& door : plan.doors) {
      if (plan.rooms[static_cast<size_t>(door.room_a)].is_passage) near.insert(door.room_b);
    }
    for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
      const bool reached = near.count(room) > 0 ||
                           std::any_of(plan.doors.begin(), plan.doors.end(), [&](const Door& door) {
                             return door.Joins(room) && near.count(door.Other(room)) > 0;
                           });
      EXPECT_TRUE(reached) << plan.rooms[static_cast<size_t>(room)].name;
    }
  }
}

TEST(OfficePlan, HasAboutATenthOfItsOpeningsFullHeightAndSomeGlass) {
  int openings = 0;
  int wide = 0;
  int inner = 0;
  double glass_m = 0.0;
  double front_m = 0.0;
  int pillars = 0;
  for (uint64_t seed = 1; seed <= kSeedCount; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const FloorPlan plan = MakePlan(seed);
    int glass_here = 0;
    for (const Door& door : plan.doors) {
      if (plan.rooms[static_cast<size_t>(door.room_b)].is_passage) {
        EXPECT_EQ(door.kind, OpeningKind::kFullHeight) << "a corridor goes on";
        continue;
      }
      ++openings;
      if (door.kind == OpeningKind::kFullHeight) ++wide;
      if (!plan.rooms[static_cast<size_t>(door.room_a)].is_passage) ++inner;
      const bool is_door = door.kind == OpeningKind::kDoor;
      EXPECT_GE(door.width_m, is_door ? 0.9 : 1.2);
      EXPECT_LE(door.width_m, is_door ? 1.0 : 2.4);
    }
    std::vector<Rect> cells;
    for (const Room& room : plan.rooms) cells.push_back(room.cell);
    for (const SharedWall& wall : SharedWallsOf(cells)) {
      if (!plan.rooms[static_cast<size_t>(wall.a)].is_passage) continue;
      if (!plan.rooms[static_cast<size_t>(wall.b)].is_passage) front_m += wall.length_m();
    }
    for (const Structure& part : plan.structures) {
      if (part.type == "pillar") ++pillars;
      if (part.type != "glass") continue;
      ++glass_here;
      // The corridor and the room each have their half.
      glass_m += 0.5 * part.rect.sizes().maxCoeff();
      EXPECT_NEAR(part.rect.sizes().minCoeff(), kHalfWallM, 1e-9);
      EXPECT_EQ(part.z_min_m, 0.0);
    }
    EXPECT_GE(glass_here, 2);
    EXPECT_EQ(glass_here % 2, 0);
  }
  const double wide_share = static_cast<double>(wide) / openings;
  EXPECT_GT(wide_share, 0.07);
  EXPECT_LT(wide_share, 0.13);
  EXPECT_GT(glass_m / front_m, 0.025);
  EXPECT_LT(glass_m / front_m, 0.08);
  EXPECT_GT(inner, static_cast<int>(2 * kSeedCount));
  EXPECT_GT(pillars, static_cast<int>(10 * kSeedCount));
}

TEST(SharedWalls, AreFoundOnBothAxesAndNotAtCorners) {
  const std::vector<Rect> cells = {Rect(Point(0, 0), Point(4, 3)), Rect(Point(4, 1), Point(6, 5)),
                                   Rect(Point(1, 3), Point(4, 5)), Rect(Point(6, 5), Point(7, 7))};
  const std::vector<SharedWall> walls = SharedWallsOf(cells);
  ASSERT_EQ(walls.size(), 3u);
  EXPECT_EQ(walls[0].b, 1);
  EXPECT_FALSE(walls[0].runs_along_x);
  EXPECT_EQ(walls[0].line_m, 4.0);
  EXPECT_EQ(walls[0].from_m, 1.0);
  EXPECT_EQ(walls[0].to_m, 3.0);
  EXPECT_EQ(walls[1].b, 2);
  EXPECT_TRUE(walls[1].runs_along_x);
  EXPECT_EQ(walls[1].At(2.0), Point(2.0, 3.0));
  EXPECT_EQ(walls[2].a, 1);
  EXPECT_EQ(walls[2].line_m, 4.0);
  EXPECT_EQ(walls[2].from_m, 3.0);
  EXPECT_EQ(walls[2].to_m, 5.0);
}

}  // namespace
}  // namespace dsg::simulator
