// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/free_grid.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace dsg::simulator {
namespace {

uint8_t CellAt(const truth::FreeGrid& grid, double x, double y) {
  const auto column = static_cast<size_t>((x - grid.origin_map.x()) / grid.cell_m);
  const auto row = static_cast<size_t>((y - grid.origin_map.y()) / grid.cell_m);
  return grid.cells[row * static_cast<size_t>(grid.width) + column];
}

class FreeGrids : public testing::TestWithParam<WorldKind> {
 protected:
  const World world_ = *GenerateWorld({GetParam(), 7});
  const Scene scene_ = BuildScene(world_, {});
  const truth::FreeGrid grid_ = MakeFreeGrid(world_, scene_, world_.places.places.front().position);
};

TEST_P(FreeGrids, CoverTheBuilding) {
  EXPECT_NEAR(grid_.width * grid_.cell_m, world_.Bounds().sizes().x(), grid_.cell_m);
  EXPECT_NEAR(grid_.height * grid_.cell_m, world_.Bounds().sizes().y(), grid_.cell_m);
}

TEST_P(FreeGrids, HoldEveryPlaceFree) {
  for (const Place& place : world_.places.places) {
    EXPECT_TRUE(CellAt(grid_, place.position.x(), place.position.y()) & truth::kCellFree)
        << place.position.transpose();
  }
}

TEST_P(FreeGrids, HoldWallsAndTheInsideOfFurnitureOccupied) {
  for (const Structure& structure : world_.plan.structures) {
    if (!structure.IsObstacle()) continue;
    const Point middle = structure.rect.center();
    EXPECT_FALSE(CellAt(grid_, middle.x(), middle.y()) & truth::kCellFree) << middle.transpose();
  }
  int checked_count = 0;
  for (const Furniture& item : world_.furniture) {
    if (item.class_name != "fridge" && item.class_name != "wardrobe") continue;
    EXPECT_FALSE(CellAt(grid_, item.center.x(), item.center.y()) & truth::kCellFree) << item.name;
    ++checked_count;
  }
  EXPECT_GT(checked_count, 0);
}

TEST_P(FreeGrids, MarkTheBandOfEachDoorAndLittleElse) {
  for (const Door& door : world_.plan.doors) {
    EXPECT_TRUE(CellAt(grid_, door.center.x(), door.center.y()) & truth::kCellDoorBand);
  }
  const auto in_band = std::count_if(grid_.cells.begin(), grid_.cells.end(), [](uint8_t cell) {
    return (cell & truth::kCellDoorBand) != 0;
  });
  // A band is at most (width + 0.8) x (0.15 + 0.8) m.
  double area_m2 = 0.0;
  for (const Door& door : world_.plan.doors) area_m2 += (door.width_m + 1.0) * 1.15;
  EXPECT_LT(static_cast<double>(in_band) * grid_.cell_m * grid_.cell_m, area_m2);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FreeGrids,
                         testing::Values(WorldKind::kApartment, WorldKind::kWing,
                                         WorldKind::kOffice),
                         [](const auto& param) { return std::string(Name(param.param)); });

}  // namespace
}  // namespace dsg::simulator
