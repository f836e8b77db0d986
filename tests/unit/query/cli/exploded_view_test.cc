// SPDX-License-Identifier: Apache-2.0
// The picture of layers shows each that there is, above the one below.
#include "query/cli/export/exploded_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "query/cli/export/top_view.h"
#include "schema/picture/look.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using picture::Picture;

// Rows in which pixels are near to a colour, first and last; -1 without.
std::array<int, 2> RowsOf(const Picture& picture, uint32_t rgb) {
  std::array<int, 2> rows = {-1, -1};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
      int off = 0;
      for (size_t channel = 0; channel < 3; ++channel) {
        const int wanted = static_cast<int>(rgb >> (16 - 8 * channel) & 255u);
        off = std::max(off, std::abs(picture.rgb[i + channel] - wanted));
      }
      if (off > 8) continue;
      if (rows[0] < 0) rows[0] = y;
      rows[1] = y;
    }
  }
  return rows;
}

MapContent WithBuilding() {
  MapContent content = test::ExampleContent();
  Node building;
  building.id = NodeId('B', 0);
  building.layer = layers::kBuildings;
  building.kind = kinds::kBuilding;
  building.map_T_node.position = {4.0, 2.0, 0.0};
  content.nodes.push_back(building);
  content.edges.push_back(
      {.source = NodeId('B', 0), .relation = relations::kContains, .target = NodeId('R', 1)});
  content.edges.push_back(
      {.source = NodeId('R', 1), .relation = relations::kAdjacent, .target = NodeId('R', 2)});
  content.edges.push_back(
      {.source = NodeId('R', 1), .relation = relations::kContains, .target = NodeId('p', 1)});
  return content;
}

TEST(ExplodedView, PutsEachLayerAboveTheOneBelow) {
  const MapContent content = WithBuilding();
  const Picture picture = DrawExplodedView(content, {.width_px = 800, .title = "example"});
  EXPECT_EQ(picture.width, 800);
  ASSERT_EQ(picture.rgb.size(), 3 * static_cast<size_t>(800 * picture.height));
  const auto building = RowsOf(picture, LayerColor(layers::kBuildings));
  const auto links = RowsOf(picture, kRoomLinkRgb);
  const auto agent = RowsOf(picture, AgentColor(0));
  ASSERT_GE(building[0], 0);
  ASSERT_GE(agent[0], 0);
  EXPECT_LT(building[1], agent[0]);
  const auto place = std::find_if(content.nodes.begin(), content.nodes.end(),
                                  [](const Node& node) { return node.id == NodeId('p', 1); });
  ASSERT_NE(place, content.nodes.end());
  const auto room = std::find_if(content.nodes.begin(), content.nodes.end(),
                                 [](const Node& node) { return node.id == NodeId('R', 1); });
  // The room's own dot, and below it that of its place.
  const auto dots = RowsOf(picture, RoomColor(*room));
  EXPECT_LT(building[1], dots[0]);
  EXPECT_GT(dots[1] - dots[0], 60);
  EXPECT_LT(links[0], agent[0]);
}

TEST(ExplodedView, LeavesLayersOutThatAreNotThere) {
  MapContent content = WithBuilding();
  const int whole = DrawExplodedView(content, {.width_px = 600}).height;
  std::erase_if(content.nodes, [](const Node& node) { return node.kind == kinds::kBuilding; });
  std::erase_if(content.edges, [](const Edge& edge) { return edge.source == NodeId('B', 0); });
  EXPECT_LT(DrawExplodedView(content, {.width_px = 600}).height, whole);
}

TEST(ExplodedView, OfAnEmptyMapIsItsTitle) {
  const Picture picture =
      DrawExplodedView(MapContent(), {.width_px = kTopViewWidthMin, .title = "nothing"});
  EXPECT_GE(RowsOf(picture, 0x2b2f3a)[0], 0);
}

TEST(ExplodedView, KeepsNamesInsideOfThePicture) {
  MapContent content = WithBuilding();
  for (Node& node : content.nodes) {
    if (node.id == NodeId('R', 2)) node.name = "a storage room of a long name";
  }
  const Picture picture = DrawExplodedView(content, {.width_px = 800});
  constexpr int kBorder = 7;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = picture.width - kBorder; x < picture.width; ++x) {
      const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
      const uint32_t rgb = static_cast<uint32_t>(picture.rgb[i]) << 16 |
                           static_cast<uint32_t>(picture.rgb[i + 1]) << 8 | picture.rgb[i + 2];
      ASSERT_EQ(rgb, kPaperRgb) << x << " " << y;
    }
  }
}

TEST(ExplodedView, HasALegendBelow) {
  const MapContent content = WithBuilding();
  const Picture picture = DrawExplodedView(content, {.width_px = 800});
  // Only the legend is below the lowest level, with the mark of the human.
  EXPECT_GT(RowsOf(picture, AgentColor(0))[1], picture.height - 90);
  EXPECT_GE(RowsOf(picture, kInkRgb)[1], picture.height - 90);
}

TEST(ExplodedView, KeepsLongAndHighMapsInBounds) {
  for (const Eigen::Vector3d& far :
       {Eigen::Vector3d(0, 5000, 0), Eigen::Vector3d(5000, 0, 0), Eigen::Vector3d(0, 0, 5000)}) {
    MapContent content;
    content.tracks = {{NodeId('r', 1), {{Eigen::Vector3d::Zero(), far}}, {}}};
    const Picture picture = DrawExplodedView(content, {.width_px = 400});
    EXPECT_EQ(picture.width, 400);
    EXPECT_LE(picture.height, kTopViewWidthMax);
  }
}

TEST(MeshViews, ShowMapsFromTheSamePlace) {
  const MapContent left = test::ExampleContent();
  MapContent right = test::ExampleContent();
  right.mesh.push_back(test::FlatBlock(3));
  const Picture picture = DrawMeshes({{left, "same title"}, {right, "same title"}}, 800);
  ASSERT_EQ(picture.width, 800);
  ASSERT_EQ(picture.rgb.size(), 3 * static_cast<size_t>(800 * picture.height));
  int left_count = 0;
  int right_count = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < 400; ++x) {
      const auto at = picture.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * 800 + x);
      const auto is_drawn = [](auto pixel) {
        return (pixel[0] << 16 | pixel[1] << 8 | pixel[2]) != static_cast<int>(kPaperRgb);
      };
      // What both have is at the same pixels of both; the third block is beside it.
      EXPECT_TRUE(!is_drawn(at) || is_drawn(at + 3 * 400)) << x << " " << y;
      left_count += is_drawn(at) ? 1 : 0;
      right_count += is_drawn(at + 3 * 400) ? 1 : 0;
    }
  }
  EXPECT_GT(left_count, 1000);
  EXPECT_GT(right_count, left_count * 5 / 4);
}

TEST(ExplodedView, IsTheSameEachTime) {
  const MapContent content = WithBuilding();
  EXPECT_EQ(DrawExplodedView(content, {}).rgb, DrawExplodedView(content, {}).rgb);
}

}  // namespace
}  // namespace dsg::cli
