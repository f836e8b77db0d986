// SPDX-License-Identifier: Apache-2.0
// The picture from above shows what there is, where it is.
#include "query/cli/export/top_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "query/cli/export/map_content.h"
#include "query/cli/export/outline.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/picture/look.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using Pixel = std::array<int, 3>;
using picture::Picture;

constexpr Pixel kPaper = {251, 250, 247};

Pixel At(const Picture& picture, int x, int y) {
  const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

// Of the columns in which anything is drawn in a row, how many.
int InkIn(const Picture& picture, int x_begin, int x_end, int y_begin, int y_end) {
  int count = 0;
  for (int y = y_begin; y < y_end; ++y) {
    for (int x = x_begin; x < x_end; ++x) count += At(picture, x, y) != kPaper;
  }
  return count;
}

TEST(TopView, IsAsWideAsAskedAndFillsRooms) {
  MapContent content = test::ExampleContent();
  content.mesh.clear();
  for (const int width : {kTopViewWidthMin, 801, 1600}) {
    const Picture picture = DrawTopView(content, {.width_px = width, .title = "example"});
    EXPECT_EQ(picture.width, width);
    ASSERT_EQ(picture.rgb.size(), 3 * static_cast<size_t>(width * picture.height));
    // The map is 8 m wide and 4 m high with a margin of 30 pixels, and 48 for the labels of the y
    // axis; the room's lower left part is free of everything else.
    const double px_per_m = (width - 108.0) / 8.0;
    const int x = static_cast<int>(78.0 + 0.3 * px_per_m);
    const int y = static_cast<int>(65.0 + (4.0 - 0.3) * px_per_m);
    EXPECT_NE(At(picture, x, y), kPaper);
    EXPECT_EQ(At(picture, 5, picture.height / 2), kPaper);
  }
}

TEST(TopView, OfAnEmptyMapIsItsTitle) {
  const Picture picture = DrawTopView(MapContent(), {.width_px = 400, .title = "nothing"});
  EXPECT_GT(InkIn(picture, 0, 400, 0, 60), 50);
  EXPECT_EQ(InkIn(picture, 0, 400, 75, picture.height - 60), 0);
}

// A room of 8 m x 4 m with an agent in its middle, where the room's name would stand.
MapContent RoomAround(const NodeId& id, const char* kind) {
  Node room;
  room.id = NodeId('R', 1);
  room.kind = kinds::kRoom;
  room.layer = layers::kRooms;
  room.name = "a room of a name";
  room.map_T_node.position = {4.0, 2.0, 1.0};
  room.box_node = Box3d(Eigen::Vector3d(-4.0, -2.0, -1.0), Eigen::Vector3d(4.0, 2.0, 1.0));
  Node agent;
  agent.id = id;
  agent.kind = kind;
  agent.layer = layers::kAgents;
  MapContent content;
  content.nodes = {room, agent};
  content.tracks = {{.agent = id, .pieces = {{{4.0, 2.0, 0.0}}}, .poses = {}}};
  return content;
}

Pixel ColorOf(uint32_t rgb) {
  return {static_cast<int>(rgb >> 16), static_cast<int>(rgb >> 8 & 0xff),
          static_cast<int>(rgb & 0xff)};
}

TEST(TopView, NoNameHidesAnAgentAndItsShapeSaysItsKind) {
  constexpr int kWidth = 801;
  const double px_per_m = (kWidth - 108.0) / 8.0;
  const int x = static_cast<int>(78.0 + 4.0 * px_per_m);
  const int y = static_cast<int>(65.0 + 2.0 * px_per_m);
  const auto draw = [&](NodeId id, const char* kind) {
    return DrawTopView(RoomAround(id, kind), {.width_px = kWidth, .title = ""});
  };
  const Picture human = draw(NodeId('H', 1), kinds::kHuman);
  const Picture robot = draw(NodeId('r', 1), kinds::kRobot);
  for (const Picture& picture : {human, robot}) {
    for (int step = -3; step <= 3; ++step) {
      EXPECT_EQ(At(picture, x + step, y), ColorOf(AgentColor(0)));
      EXPECT_EQ(At(picture, x, y + step), ColorOf(AgentColor(0)));
    }
  }
  // A dot and a square of one colour.
  EXPECT_NE(At(human, x + 4, y + 4), ColorOf(AgentColor(0)));
  EXPECT_EQ(At(robot, x + 4, y + 4), ColorOf(AgentColor(0)));
  // So the legend tells them apart, too.
  int different = 0;
  for (int row = human.height - 60; row < human.height - 20; ++row) {
    for (int column = 30; column < kWidth; ++column) {
      different += At(human, column, row) != At(robot, column, row);
    }
  }
  EXPECT_GT(different, 20);
}

TEST(TopView, DrawsAMeshWithoutNodes) {
  MapContent content;
  content.mesh = {test::FlatBlock(0), test::FlatBlock(1)};
  const Picture picture = DrawTopView(content, {.width_px = 400, .title = ""});
  EXPECT_NE(At(picture, 200, 200), kPaper);
}

TEST(TopView, KeepsTheHeightOfNarrowMapsInBounds) {
  MapContent content;
  content.tracks = {{NodeId('r', 1), {{{0, 0, 0}, {0, 500, 0}}}}};
  Node robot;
  robot.id = NodeId('r', 1);
  robot.kind = kinds::kRobot;
  robot.layer = layers::kAgents;
  content.nodes = {robot};
  const Picture picture = DrawTopView(content, {.width_px = 300, .title = "corridor"});
  EXPECT_LE(picture.height, 600);
  const Picture wide = DrawTopView(content, {.width_px = kTopViewWidthMax, .title = ""});
  EXPECT_LE(wide.height, kTopViewWidthMax);
}

TEST(TopView, DrawsASlantedWallAsALineInItsBox) {
  Node wall;
  wall.id = NodeId('S', 1);
  wall.kind = kinds::kStructure;
  wall.layer = layers::kStructures;
  wall.box_node = Box3d(Eigen::Vector3d(-4.0, -4.0, 0.0), Eigen::Vector3d(4.0, 4.0, 2.5));
  MapContent content;
  const auto ink = [&](const Eigen::Vector3d& normal) {
    wall.structure = StructureInfo{"wall", normal, 0.0, 0};
    content.nodes = {wall};
    const Picture picture = DrawTopView(content, {.width_px = 400, .title = ""});
    // Inside of the axes.
    return InkIn(picture, 82, 366, 70, 352);
  };
  // The box of one along the axes is all there is to know of it.
  EXPECT_GT(ink({1.0, 0.0, 0.0}), 75'000);
  const int line = ink(Eigen::Vector3d(1.0, 1.0, 0.0).normalized());
  EXPECT_GT(line, 300);
  EXPECT_LT(line, 3000);
}

TEST(TopView, IsTheSameForTheSameMap) {
  const MapContent content = test::ExampleContent();
  EXPECT_EQ(DrawTopView(content, {.title = "a"}).rgb, DrawTopView(content, {.title = "a"}).rgb);
}

TEST(TopView, DrawsThousandsOfNodesOfAnySize) {
  MapContent content;
  content.layers = DefaultLayers();
  Random random(1, 0);
  for (uint64_t i = 0; i < 3000; ++i) {
    Node node;
    node.id = NodeId('O', i);
    node.kind = kinds::kObject;
    node.layer = layers::kObjects;
    node.name = "thing";
    node.map_T_node.position = {random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0), 0.0};
    const double half_m = 0.5 * std::pow(10.0, random.Uniform(-4.0, 1.0));
    node.box_node = Box3d(Eigen::Vector3d::Constant(-half_m), Eigen::Vector3d::Constant(half_m));
    content.nodes.push_back(node);
  }
  const Picture picture = DrawTopView(content, {.title = "many"});
  EXPECT_GT(InkIn(picture, 0, picture.width, 0, picture.height), 100'000);
}

TEST(FloorChoice, TakesANodesHeightsOrThoseOfTheRoomsAround) {
  const MapContent content = test::ExampleContent();
  const auto by_id = ChooseFloor(content, "R2");
  ASSERT_TRUE(by_id.ok()) << by_id.status();
  EXPECT_EQ(by_id->high_m, 3.0);
  EXPECT_EQ(ChooseFloor(content, "Küche \"Süd\"")->low_m, 0.0);
  EXPECT_EQ(ChooseFloor(content, "2.9")->high_m, 3.0);
  EXPECT_EQ(ReasonOf(ChooseFloor(content, "10").status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(ChooseFloor(content, "attic").status()), Reason::kNodeUnknown);
  EXPECT_EQ(ReasonOf(ChooseFloor(content, "nan").status()), Reason::kNodeUnknown);
}

TEST(FloorChoice, DropsWhatIsOnAnotherFloor) {
  MapContent content = test::ExampleContent();
  content.tracks[0].pieces[0][1].z() = 9.0;
  KeepFloor({0.9, 1.1}, &content);
  // The places, and the human, who walks there; rooms, wall and chair have their middles elsewhere.
  EXPECT_EQ(content.nodes.size(), 3u);
  ASSERT_EQ(content.edges.size(), 1u);
  EXPECT_EQ(content.edges[0].relation, relations::kTraversable);
  EXPECT_EQ(content.tracks[0].pieces.size(), 3u);
  EXPECT_TRUE(content.mesh[0].faces.empty());
  KeepFloor({50.0, 60.0}, &content);
  EXPECT_TRUE(content.tracks.empty());
}

TEST(FloorChoice, KeepsTracksThatLieOnTheFloorAndCutsWaysThatLeaveIt) {
  MapContent content = test::ExampleContent();
  const size_t piece_count = content.tracks[0].pieces.size();
  for (auto& piece : content.tracks[0].pieces) {
    for (Eigen::Vector3d& point : piece) point.z() = -0.02;
  }
  KeepFloor({0.0, 3.0}, &content);
  EXPECT_EQ(content.tracks[0].pieces.size(), piece_count);
  Overlay overlay;
  overlay.lines.push_back(
      {.points_map = {{0, 0, 0}, {1, 0, 0}, {2, 0, 3.5}, {3, 0, 0}, {4, 0, 0}}});
  overlay.marks = {{.position_map = {1, 1, 1}}, {.position_map = {1, 1, 4}}};
  overlay.outlines = {{.height_m = 1.0}, {.height_m = 4.0}};
  KeepFloor({0.0, 3.0}, &overlay);
  ASSERT_EQ(overlay.lines.size(), 2u);
  EXPECT_EQ(overlay.lines[1].points_map.front().x(), 3.0);
  EXPECT_EQ(overlay.marks.size(), 1u);
  EXPECT_EQ(overlay.outlines.size(), 1u);
}

TEST(Outline, IsTheHullOfTheTurnedBox) {
  const Polygon2d outline = FloorOutline(test::ExampleContent().nodes[1]);
  EXPECT_EQ(outline.size(), 4u);
  EXPECT_NEAR(std::abs(SignedArea(outline)), 0.5, 1e-9);
  EXPECT_TRUE(FloorOutline(Node()).empty());
}

TEST(Outline, OfRandomPointsHoldsThemAll) {
  Random random(1, 0);
  for (int round = 0; round < 200; ++round) {
    Polygon2d points;
    for (int i = 0; i < 2 + round % 40; ++i) {
      // On a coarse grid, so that many lie on one line or coincide.
      points.emplace_back(random.Integer(0, 6), random.Integer(0, 6));
    }
    const Polygon2d hull = ConvexHull(points);
    if (hull.size() < 3) continue;
    for (const Eigen::Vector2d& point : points) {
      EXPECT_LE(SignedDistanceToPolygon(hull, point), 1e-9);
    }
  }
}

}  // namespace
}  // namespace dsg::cli
