// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/mesh_cut.h"

#include <gtest/gtest.h>

namespace dsg {
namespace {

// Unit squares in a row along x, two triangles each, at z = 0.
MeshBlock Row(int square_count) {
  MeshBlock block;
  for (int i = 0; i <= square_count; ++i) {
    for (const float y : {0.0f, 1.0f}) {
      block.positions_map.emplace_back(static_cast<float>(i), y, 0.0f);
      block.colors.push_back(static_cast<uint32_t>(block.colors.size()));
    }
  }
  for (uint32_t i = 0; i < static_cast<uint32_t>(square_count); ++i) {
    block.faces.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    block.faces.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  return block;
}

TEST(MeshCut, TakesFacesInsideAndKeepsTheRestAstride) {
  const MeshBlock block = Row(4);
  bool is_cut = false;
  const Solid solid{Box3d(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(2, 2, 1)), {}};
  const MeshBlock rest = CutMesh(block, {solid}, &is_cut);
  EXPECT_TRUE(is_cut);
  ASSERT_EQ(rest.faces.size(), 4u);
  // The corners at x = 2 are still used.
  ASSERT_EQ(rest.positions_map.size(), 6u);
  EXPECT_EQ(rest.positions_map.front().x(), 2.0f);
  EXPECT_EQ(rest.colors, (std::vector<uint32_t>{4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(rest.faces.front(), (std::array<uint32_t, 3>{0, 2, 1}));
}

TEST(MeshCut, LeavesABlockBesideAsItIs) {
  const MeshBlock block = Row(4);
  bool is_cut = true;
  const Solid solid{Box3d(Eigen::Vector3d(5, -1, -1), Eigen::Vector3d(9, 2, 1)), {}};
  const MeshBlock rest = CutMesh(block, {solid}, &is_cut);
  EXPECT_FALSE(is_cut);
  EXPECT_EQ(rest.faces, block.faces);
}

TEST(MeshCut, FollowsAFloorPlanAndLoosePoints) {
  MeshBlock block = Row(4);
  block.positions_map.emplace_back(1.0f, 0.2f, 0.0f);
  block.colors.push_back(77);
  Solid solid{Box3d(Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(4, 1, 1)), {}};
  // Only the left half.
  solid.footprint_map = {{0, 0}, {2, 0}, {2, 1}, {0, 1}};
  bool is_cut = false;
  const MeshBlock rest = CutMesh(block, {solid}, &is_cut);
  EXPECT_EQ(rest.faces.size(), 4u);
  EXPECT_EQ(std::count(rest.colors.begin(), rest.colors.end(), 77u), 0);
}

TEST(MeshCut, CanTakeAll) {
  bool is_cut = false;
  const Solid all{Box3d(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9)), {}};
  const MeshBlock rest = CutMesh(Row(3), {all}, &is_cut);
  EXPECT_TRUE(is_cut);
  EXPECT_TRUE(rest.positions_map.empty());
  EXPECT_TRUE(rest.faces.empty());
}

}  // namespace
}  // namespace dsg
