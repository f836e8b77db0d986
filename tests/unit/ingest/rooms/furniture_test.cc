// SPDX-License-Identifier: Apache-2.0
// Furniture is no wall, and its floor is the room's, on drawn plans.
#include "ingest/rooms/furniture.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "ingest/rooms/find_rooms.h"
#include "tests/unit/ingest/rooms/drawing.h"

namespace dsg::ingest {
namespace {

OccupancyGrid WithoutIslands(const Drawing& drawing) {
  OccupancyGrid plan = drawing.plan();
  FreeIslands({}, &plan);
  return plan;
}

Occupancy StateAt(const OccupancyGrid& plan, double x, double y) {
  return plan.AtPoint({x, y, 0.5 * kDrawnCellM});
}

TEST(Islands, OfFurnitureAreFree) {
  Drawing drawing(8, 8);
  drawing.Free(0.5, 0.5, 7.5, 7.5);
  // A leg, a bin, a table that was never seen inside.
  drawing.Wall(2.0, 2.0, 2.1, 2.1).Wall(4.0, 2.0, 4.4, 2.4);
  drawing.Wall(3.0, 4.0, 5.0, 5.0).Unseen(3.2, 4.2, 4.8, 4.8);
  const OccupancyGrid plan = WithoutIslands(drawing);
  EXPECT_EQ(StateAt(plan, 2.05, 2.05), Occupancy::kFree);
  EXPECT_EQ(StateAt(plan, 4.2, 2.2), Occupancy::kFree);
  EXPECT_EQ(StateAt(plan, 3.1, 4.1), Occupancy::kFree);
  EXPECT_EQ(StateAt(plan, 4.0, 4.5), Occupancy::kFree);
  EXPECT_EQ(StateAt(plan, 0.2, 0.2), Occupancy::kOccupied);
}

TEST(Islands, ThatMayBeWallsStay) {
  Drawing drawing(12, 8);
  drawing.Free(0.5, 0.5, 11.5, 7.5);
  // A thin wall that stands alone, one that was seen in dashes, a corner of walls, and a hole in
  // what was seen.
  drawing.Wall(2.0, 2.0, 2.2, 4.0);
  for (int dash = 0; dash < 12; ++dash) {
    drawing.Wall(4.0, 2.0 + 0.2 * dash, 4.1, 2.15 + 0.2 * dash);
  }
  drawing.Wall(6.0, 2.0, 8.0, 2.2).Wall(6.0, 2.0, 6.2, 4.0).Unseen(9.0, 2.0, 9.3, 2.3);
  const OccupancyGrid plan = WithoutIslands(drawing);
  EXPECT_EQ(plan.cells, drawing.plan().cells);
}

TEST(Islands, AtTheRimAreNone) {
  Drawing drawing(4, 4);
  drawing.Free(0.0, 0.0, 4.0, 4.0).Wall(0.0, 1.0, 0.2, 1.2);
  EXPECT_EQ(WithoutIslands(drawing).cells, drawing.plan().cells);
}

// Rooms of the free cells of a drawing, one left and one right of a line, and what they have once
// furniture is covered.
class Covered {
 public:
  explicit Covered(const Drawing& drawing, double line_x = 1e6,
                   const FurnitureOptions& options = {}) {
    regions_ = {drawing.plan().frame, {}, line_x < 1e6 ? 2 : 1};
    for (int64_t i = 0; i < regions_.frame.CellCount(); ++i) {
      const bool is_free = drawing.plan().cells[static_cast<size_t>(i)] == Occupancy::kFree;
      const bool is_left = regions_.frame.Center(regions_.frame.Cell(i)).x() < line_x;
      regions_.region_of.push_back(is_free ? is_left ? 0 : 1 : -1);
    }
    CoverFurniture(options, &regions_);
  }
  int At(double x, double y) const { return regions_.At({x, y}); }
  double AreaM2() const {
    int64_t count = 0;
    for (const int64_t cells : regions_.CellCounts()) count += cells;
    return static_cast<double>(count) * kDrawnCellM * kDrawnCellM;
  }

 private:
  PlanRegions regions_;
};

TEST(Cover, GivesARoomWhatStandsInItsCornersAndAlongItsWalls) {
  Drawing drawing(6, 5);
  drawing.Free(0.5, 0.5, 5.5, 4.5);
  // A cupboard in a corner, one along a wall, one across the wall opposite.
  drawing.Wall(0.5, 0.5, 1.5, 1.0).Wall(3.0, 0.5, 4.2, 1.0).Wall(4.9, 2.0, 5.5, 4.0);
  const Covered covered(drawing);
  EXPECT_NEAR(covered.AreaM2(), 20.0, 0.1);
  EXPECT_EQ(covered.At(0.55, 0.55), 0);
  EXPECT_EQ(covered.At(5.45, 3.0), 0);
  EXPECT_EQ(covered.At(0.45, 0.55), -1);
}

TEST(Cover, LeavesWallsDoorwaysAndShafts) {
  // Two rooms with a door in a wall of 0.3 m, and a shaft of 2 m x 2 m in a corner.
  Drawing drawing(11, 5);
  drawing.Free(0.5, 0.5, 5.0, 4.5).Free(5.3, 0.5, 10.5, 4.5).Wall(8.5, 2.5, 10.5, 4.5);
  drawing.Free(5.0, 2.0, 5.3, 2.9);
  EXPECT_NEAR(Covered(drawing, 5.15).AreaM2(), 4.5 * 4.0 + 5.2 * 4.0 - 4.0 + 0.9 * 0.3, 1e-6);
}

TEST(Cover, IsWhatTheOptionsSay) {
  Drawing drawing(6, 5);
  drawing.Free(0.5, 0.5, 5.5, 4.5).Wall(0.5, 0.5, 1.5, 1.0);
  EXPECT_NEAR(Covered(drawing).AreaM2(), 20.0, 0.1);
  EXPECT_NEAR(Covered(drawing, 1e6, {.deep_m = 0.3}).AreaM2(), 19.5, 0.1);
  EXPECT_NEAR(Covered(drawing, 1e6, {.long_m = 0.8}).AreaM2(), 19.5, 0.1);
}

TEST(Cover, WorksAtAnyAngle) {
  for (int step = 0; step < 6; ++step) {
    // A room of 5 m x 4 m with a cupboard of 1.2 m x 0.5 m in a corner, turned.
    Drawing drawing(9, 9);
    OccupancyGrid plan = drawing.plan();
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.1 + 0.25 * step).toRotationMatrix();
    const auto in_room = [&](const Eigen::Vector2d& at) {
      const Eigen::Vector2d own = turn.transpose() * (at - Eigen::Vector2d(4.5, 4.5));
      return std::pair((own.array().abs() < Eigen::Array2d(2.5, 2.0)).all(),
                       own.x() < -1.3 && own.y() < -1.5);
    };
    std::vector<uint8_t> is_free;
    double room_m2 = 0.0;
    for (int64_t i = 0; i < plan.frame.CellCount(); ++i) {
      const auto [is_room, is_cupboard] = in_room(plan.frame.Center(plan.frame.Cell(i)).head<2>());
      is_free.push_back(is_room && !is_cupboard ? 1 : 0);
      room_m2 += is_room ? kDrawnCellM * kDrawnCellM : 0.0;
    }
    PlanRegions regions = LabelRegions(plan.frame, is_free, 1.0);
    CoverFurniture({}, &regions);
    const double area_m2 = static_cast<double>(regions.CellCounts()[0]) * kDrawnCellM * kDrawnCellM;
    // A rough wall may count for a cell's width.
    EXPECT_NEAR(area_m2, room_m2, 0.3) << step;
  }
}

TEST(Furniture, MakesNoRoomsOfItsOwn) {
  // A ring of chairs in the middle of a room, and cupboards along its walls.
  Drawing drawing(9, 9);
  drawing.Free(0.5, 0.5, 8.5, 8.5);
  for (int leg = 0; leg < 24; ++leg) {
    const double angle = leg * std::numbers::pi / 12.0;
    const double x = 4.5 + 2.0 * std::cos(angle), y = 4.5 + 2.0 * std::sin(angle);
    drawing.Wall(x, y, x + 0.1, y + 0.1);
  }
  drawing.Wall(0.5, 0.5, 2.5, 1.0).Wall(7.9, 3.0, 8.5, 5.5);
  const DistanceField field(drawing.plan());
  RoomInput input;
  input.field = &field;
  const RoomResult found = FindRooms(input, {.method = RoomMethod::kClearance});
  ASSERT_EQ(found.best.rooms.size(), 1u);
  EXPECT_NEAR(found.best.rooms[0].area_m2, 64.0, 0.5);
}

}  // namespace
}  // namespace dsg::ingest
