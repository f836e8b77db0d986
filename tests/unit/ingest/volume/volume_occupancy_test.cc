// SPDX-License-Identifier: Apache-2.0
// Walls are closed in the grid and doors are open, at one voxel a cell and at two.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

// A wall of 0.15 m across a room, with a door of 0.9 m from y = 0.5 to 1.4.
TestScene WallWithDoor() {
  return {{RoomOf({-3, -3, -1.5}, {3, 3, 1.5}), SolidBox({-0.02, -3, -1.5}, {0.13, 0.5, 1.5}),
           SolidBox({-0.02, 1.4, -1.5}, {0.13, 3, 1.5})}};
}

SemanticVolume SeenFromBothSides(const TestScene& scene) {
  SemanticVolume volume((VolumeOptions()));
  for (int i = -3; i <= 3; ++i) {
    for (const double side : {-1.0, 1.0}) {
      for (const double turn : {-1.5, 0.0, 1.5}) {
        const Eigen::Vector3d eye(side * 2.0, 0.7 * i, 0.1);
        const Pose3d pose = LookAt(eye, {0.0, 0.7 * i + turn, -0.1});
        EXPECT_TRUE(volume.Integrate(scene.Render(SmallCamera(), pose)).ok());
      }
    }
  }
  return volume;
}

// Columns of the row of cells through y at z = 0 that are occupied, between x = -1 and 1.
int OccupiedAcross(const OccupancyGrid& grid, double y) {
  int count = 0;
  for (double x = -1.0 + 0.5 * grid.frame.cell_m; x < 1.0; x += grid.frame.cell_m) {
    count += grid.AtPoint({x, y, 0.04}) == Occupancy::kOccupied ? 1 : 0;
  }
  return count;
}

TEST(VolumeOccupancy, ThinWallsAreClosedAndDoorsAreOpen) {
  const TestScene scene = WallWithDoor();
  SemanticVolume volume = SeenFromBothSides(scene);
  for (const double cell_m : {0.1, 0.2}) {
    SCOPED_TRACE(cell_m);
    const OccupancyGrid grid = volume.MakeOccupancy(cell_m);
    for (double y = -1.95; y < 0.45; y += 0.05) {
      EXPECT_GE(OccupiedAcross(grid, y), 1) << "a hole at y = " << y;
      EXPECT_LE(OccupiedAcross(grid, y) * cell_m, 0.41) << "a fat wall at y = " << y;
    }
    int open = 0;
    for (double y = 0.5; y < 1.4; y += 0.05) open += OccupiedAcross(grid, y) == 0 ? 1 : 0;
    EXPECT_GE(open * 0.05, 0.9 - 2.0 * cell_m) << "the door has been narrowed";
  }
}

TEST(VolumeOccupancy, CellsAreMultiplesFromTheOriginAndAgreeWithTheScene) {
  const TestScene scene = WallWithDoor();
  SemanticVolume volume = SeenFromBothSides(scene);
  const OccupancyGrid grid = volume.MakeOccupancy(0.1);
  ASSERT_EQ(static_cast<int64_t>(grid.cells.size()), grid.frame.CellCount());
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = grid.frame.origin_map[axis] / 0.1;
    EXPECT_NEAR(cells, std::round(cells), 1e-9);
  }
  int seen = 0;
  int wrong = 0;
  for (int64_t i = 0; i < grid.frame.CellCount(); ++i) {
    if (grid.cells[i] == Occupancy::kUnknown) continue;
    ++seen;
    const double distance = scene.DistanceTo(grid.frame.Center(grid.frame.Cell(i)));
    const bool is_free = grid.cells[i] == Occupancy::kFree;
    wrong += is_free ? (distance < 0.0) : (distance > 0.1 || distance < -0.45);
  }
  EXPECT_GT(seen, 50'000);
  EXPECT_LT(wrong, seen / 100);
}

TEST(VolumeOccupancy, SaysWhatIsKnownOfAPoint) {
  const SemanticVolume volume = SeenFromBothSides(WallWithDoor());
  EXPECT_EQ(volume.At({1.0, 0.0, 0.0}), Occupancy::kFree);
  EXPECT_EQ(volume.At({0.05, 0.95, 0.0}), Occupancy::kFree) << "in the door";
  EXPECT_EQ(volume.At({0.05, -1.0, 0.0}), Occupancy::kOccupied);
  EXPECT_EQ(volume.At({9.0, 0.0, 0.0}), Occupancy::kUnknown);
}

}  // namespace
}  // namespace dsg::ingest
