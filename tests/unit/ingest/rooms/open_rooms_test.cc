// SPDX-License-Identifier: Apache-2.0
// Which openings are closed, and which rooms are left whole, on drawn plans.
#include "ingest/rooms/open_rooms.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "ingest/rooms/furniture.h"
#include "ingest/rooms/plan_regions.h"
#include "tests/unit/ingest/rooms/drawing.h"

namespace dsg::ingest {
namespace {

// Areas of the rooms once open ones are closed, descending, whole square metres.
std::vector<int> RoomsOf(const Drawing& drawing, const OpenRoomOptions& options = {}) {
  OccupancyGrid plan = drawing.plan();
  FreeIslands({}, &plan);
  CloseOpenRooms(options, &plan);
  std::vector<uint8_t> is_free;
  for (const Occupancy state : plan.cells) is_free.push_back(state == Occupancy::kFree ? 1 : 0);
  std::vector<int> areas;
  for (const int64_t count : LabelRegions(plan.frame, is_free, 1.0).CellCounts()) {
    areas.push_back(
        static_cast<int>(std::lround(static_cast<double>(count) * kDrawnCellM * kDrawnCellM)));
  }
  std::sort(areas.rbegin(), areas.rend());
  return areas;
}

TEST(OpenRooms, AreClosedWhereTheyStandOpenToACorridor) {
  // A corridor of 30 m x 2 m, and three rooms of 4 m x 5 m without a wall before them.
  Drawing plan(31, 8);
  plan.Free(0.5, 0.5, 30.5, 2.5);
  for (const double x : {1.5, 13.0, 25.5}) plan.Free(x, 2.5, x + 4.0, 7.5);
  EXPECT_EQ(RoomsOf(plan), (std::vector<int>{60, 20, 20, 20}));
}

TEST(OpenRooms, AreClosedBetweenThinWallsToo) {
  // All around is one large hall, so that its hull says nothing: walls end in it.
  Drawing plan(21, 8);
  plan.Free(0.5, 0.5, 20.5, 7.5);
  for (const double x : {4.4, 8.4, 12.4, 16.4}) plan.Wall(x, 2.5, x + 0.2, 7.5);
  // The corridor may be divided between them.
  const std::vector<int> rooms = RoomsOf(plan);
  EXPECT_GE(rooms.size(), 5u) << testing::PrintToString(rooms);
  EXPECT_LE(rooms[0], 40) << testing::PrintToString(rooms);
}

TEST(OpenRooms, LeaveCompactRoomsWhole) {
  EXPECT_EQ(RoomsOf(Drawing(11, 9).Free(0.5, 0.5, 10.5, 8.5)), std::vector<int>{80});
  // Of the shape of an L.
  EXPECT_EQ(RoomsOf(Drawing(11, 9).Free(0.5, 0.5, 10.5, 4.5).Free(0.5, 0.5, 5.5, 8.5)),
            std::vector<int>{60});
  // A hall with ends of walls and pillars in it.
  Drawing hall(21, 11);
  hall.Free(0.5, 0.5, 20.5, 10.5);
  for (const double x : {5.0, 10.0, 15.0}) {
    hall.Wall(x, 0.5, x + 0.3, 1.3).Wall(x, 5.0, x + 0.6, 5.6);
  }
  EXPECT_EQ(RoomsOf(hall).size(), 1u);
}

TEST(OpenRooms, AreNoArmsOfACorridor) {
  // Two corridors that cross, 2 m wide.
  const Drawing plan = Drawing(21, 21).Free(0.5, 9.5, 20.5, 11.5).Free(9.5, 0.5, 11.5, 20.5);
  EXPECT_EQ(RoomsOf(plan).size(), 1u);
}

TEST(OpenRooms, AreWhatTheOptionsSay) {
  Drawing plan(31, 8);
  plan.Free(0.5, 0.5, 30.5, 2.5).Free(1.5, 2.5, 5.5, 7.5).Free(20.0, 2.5, 24.0, 7.5);
  ASSERT_EQ(RoomsOf(plan), (std::vector<int>{60, 20, 20}));
  OpenRoomOptions options;
  options.bay_m2_min = 60.0;
  EXPECT_EQ(RoomsOf(plan, options), std::vector<int>{100});
  options = {};
  options.width_m_max = 1.5;
  EXPECT_EQ(RoomsOf(plan, options), std::vector<int>{100});
}

TEST(OpenRooms, AreNotLookedForWhereNothingIsFree) {
  EXPECT_TRUE(RoomsOf(Drawing(5, 5)).empty());
  OccupancyGrid unknown;
  unknown.frame.size = {40, 40, 1};
  unknown.cells.assign(1600, Occupancy::kUnknown);
  CloseOpenRooms({}, &unknown);
  EXPECT_EQ(unknown.cells, std::vector<Occupancy>(1600, Occupancy::kUnknown));
}

}  // namespace
}  // namespace dsg::ingest
