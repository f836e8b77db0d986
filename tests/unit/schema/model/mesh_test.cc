// SPDX-License-Identifier: Apache-2.0
#include "schema/model/mesh.h"

#include <gtest/gtest.h>

#include <set>

namespace dsg {
namespace {

TEST(BlockOf, RoundsDownBelowZero) {
  EXPECT_EQ(BlockOf({-0.1f, 0.0f, 1.9f}, 2.0), (BlockIndex{-1, 0, 0}));
  EXPECT_EQ(BlockOf({2.0f, -2.0f, -2.1f}, 2.0), (BlockIndex{1, -1, -2}));
}

TEST(SplitIntoBlocks, KeepsEveryFaceOnceAndEveryVertexInItsBlock) {
  MeshBlock whole;
  for (int i = 0; i < 10; ++i) {
    whole.positions_map.emplace_back(static_cast<float>(i), 0.0f, 0.0f);
    whole.colors.push_back(static_cast<uint32_t>(i));
  }
  for (uint32_t i = 0; i + 2 < 10; ++i) whole.faces.push_back({i, i + 1, i + 2});
  const auto blocks = SplitIntoBlocks(whole, 2.0);
  ASSERT_EQ(blocks.size(), 5u);
  size_t face_count = 0;
  std::set<uint32_t> colors;
  for (const MeshBlock& block : blocks) {
    ASSERT_EQ(block.colors.size(), block.positions_map.size());
    face_count += block.faces.size();
    for (size_t v = 0; v < block.colors.size(); ++v) {
      // Colours were chosen to tell which vertex it is.
      EXPECT_EQ(block.positions_map[v].x(), static_cast<float>(block.colors[v]));
      if (BlockOf(block.positions_map[v], 2.0) == block.index) colors.insert(block.colors[v]);
    }
    for (const auto& face : block.faces) {
      EXPECT_EQ(block.colors[face[1]], block.colors[face[0]] + 1);
      EXPECT_EQ(block.colors[face[2]], block.colors[face[0]] + 2);
    }
  }
  EXPECT_EQ(face_count, whole.faces.size());
  EXPECT_EQ(colors.size(), 10u);
}

}  // namespace
}  // namespace dsg
