// SPDX-License-Identifier: Apache-2.0
// The picture from above shows what there is, where it is.
#include "query/cli/export/top_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "query/cli/export/map_content.h"
#include "query/cli/export/openings.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/top_view_labels.h"
#include "query/cli/export/top_view_marks.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"
#include "schema/picture/raster.h"
#include "tests/unit/query/cli/cli_test_util.h"
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

Node WallFrom(uint64_t index, double low_m, double high_m) {
  Node wall =
      test::MakeNode(NodeId('S', index), kinds::kStructure, "", {1.5, 0.4, 0.5 * (low_m + high_m)});
  wall.layer = layers::kStructures;
  wall.structure = StructureInfo{"wall", Eigen::Vector3d::UnitY(), -0.4, 0};
  const Eigen::Vector3d half(0.5, 0.1, 0.5 * (high_m - low_m));
  wall.box_node = Box3d(-half, half);
  return wall;
}

Node RoomFrom(uint64_t index, double low_m, double high_m) {
  Node room = test::MakeNode(NodeId('R', index), kinds::kRoom, "", {4.0, 2.0, low_m});
  room.layer = layers::kRooms;
  room.region = RegionInfo{{{0, 0}, {8, 0}, {8, 4}, {0, 4}}, low_m, high_m, {}};
  return room;
}

TEST(TopView, LeavesDoorsOpenBelowTheirWalls) {
  constexpr int kWidth = 801;
  const double px_per_m = (kWidth - 108.0) / 8.0;
  const int x = static_cast<int>(78.0 + 1.5 * px_per_m);
  const int y = static_cast<int>(65.0 + (4.0 - 0.4) * px_per_m);
  MapContent content;
  content.nodes = {RoomFrom(1, 0.0, 3.0), WallFrom(1, 0.0, 3.0)};
  EXPECT_EQ(At(DrawTopView(content, {.width_px = kWidth}), x, y), ColorOf(kWallRgb));
  content.nodes[1] = WallFrom(1, 2.1, 3.0);
  EXPECT_NE(At(DrawTopView(content, {.width_px = kWidth}), x, y), ColorOf(kWallRgb));
}

// A wall along x from 0 to 4, as a box of 0.2 m or a plane of it, with places on both sides at x.
MapContent WallWithWays(double thickness_m, const std::vector<double>& ways_x, double clear_m) {
  Node wall;
  wall.id = NodeId('S', 1);
  wall.kind = kinds::kStructure;
  wall.map_T_node.position = {2.0, 1.0, 1.25};
  const Eigen::Vector3d half(2.0, 0.5 * thickness_m, 1.25);
  wall.box_node = Box3d(-half, half);
  wall.structure.emplace().structure_type = "wall";
  MapContent content;
  content.nodes = {wall};
  for (size_t i = 0; i < ways_x.size(); ++i) {
    for (const double y : {0.4, 1.6}) {
      Node place;
      place.id = NodeId('p', 2 * i + (y < 1.0 ? 0 : 1));
      place.kind = kinds::kPlace;
      place.map_T_node.position = {ways_x[i], y, 0.0};
      content.nodes.push_back(place);
    }
    Edge way;
    way.source = NodeId('p', 2 * i);
    way.relation = relations::kTraversable;
    way.target = NodeId('p', 2 * i + 1);
    way.weight = clear_m;
    content.edges.push_back(way);
  }
  return content;
}

TEST(Openings, AreWhereWaysLeadThroughAWallAndAsWideAsTheseAreClear) {
  for (const double thickness_m : {0.0, 0.2}) {
    SCOPED_TRACE(thickness_m);
    const MapContent content = WallWithWays(thickness_m, {1.0, 3.0, 3.3, 5.0}, 0.4);
    const auto pieces = Openings(content).PiecesOf(content.nodes[0]);
    ASSERT_TRUE(pieces.has_value());
    std::vector<double> ends;
    for (const WallLine& piece : *pieces) {
      EXPECT_DOUBLE_EQ(piece.thickness_m, thickness_m);
      EXPECT_NEAR(piece.from.y(), 1.0, 1e-9);
      ends.push_back(std::min(piece.from.x(), piece.to.x()));
      ends.push_back(std::max(piece.from.x(), piece.to.x()));
    }
    std::sort(ends.begin(), ends.end());
    const std::vector<double> wanted = {0.0, 0.6, 1.4, 2.6, 3.7, 4.0};
    ASSERT_EQ(ends.size(), wanted.size());
    for (size_t i = 0; i < ends.size(); ++i) EXPECT_NEAR(ends[i], wanted[i], 1e-9);
  }
}

TEST(Openings, OfAWallWithoutWaysAreNone) {
  const MapContent beside = WallWithWays(0.2, {5.0}, 0.4);
  EXPECT_FALSE(Openings(beside).PiecesOf(beside.nodes[0]).has_value());
  MapContent above = WallWithWays(0.2, {1.0}, 0.4);
  for (Node& node : above.nodes) {
    if (node.kind == kinds::kPlace) node.map_T_node.position.z() = 3.0;
  }
  EXPECT_FALSE(Openings(above).PiecesOf(above.nodes[0]).has_value());
}

TEST(OverHead, IsMeasuredFromTheFloorOfEachStorey) {
  const std::unordered_set<NodeId> lintels = {NodeId('S', 2), NodeId('S', 4)};
  MapContent content;
  // Two storeys, each with a wall and the piece over its door.
  content.nodes = {WallFrom(1, 0.0, 3.0), WallFrom(2, 2.1, 3.0), WallFrom(3, 3.0, 6.0),
                   WallFrom(4, 5.1, 6.0)};
  EXPECT_EQ(StructuresOverHead(content), lintels) << "beside other walls";
  content.nodes.push_back(RoomFrom(1, 0.0, 3.0));
  content.nodes.push_back(RoomFrom(2, 3.0, 6.0));
  EXPECT_EQ(StructuresOverHead(content), lintels) << "in rooms";
  for (uint64_t wall = 1; wall <= 4; ++wall) {
    content.edges.push_back(
        test::MakeEdge(NodeId('S', wall), relations::kEncloses, NodeId('R', wall <= 2 ? 1 : 2)));
  }
  EXPECT_EQ(StructuresOverHead(content), lintels) << "of rooms";
  // Its own room says more than the lower one around it.
  content.nodes.push_back(RoomFrom(3, 1.0, 4.0));
  content.edges[1].target = NodeId('R', 3);
  EXPECT_EQ(StructuresOverHead(content), std::unordered_set<NodeId>{NodeId('S', 4)});
}

std::vector<std::string> TextsOf(const std::vector<LegendEntry>& entries) {
  std::vector<std::string> texts;
  for (const LegendEntry& entry : entries) texts.push_back(entry.text);
  return texts;
}

TEST(Legend, HasTheLinesThatAreDrawnAndNoOthers) {
  MapContent content = test::ExampleContent();
  using Texts = std::vector<std::string>;
  const Texts kinds_only = {"2 rooms", "1 structure", "2 places", "1 object", "1 human"};
  Texts with_ways = kinds_only;
  with_ways.push_back("ways between places");
  EXPECT_EQ(TextsOf(MapLegend(content)), with_ways);
  Texts with_both = kinds_only;
  with_both.insert(with_both.end(), {"neighbouring rooms", "ways between places"});
  content.edges.push_back(test::MakeEdge(NodeId('R', 1), relations::kAdjacent, NodeId('R', 2)));
  EXPECT_EQ(TextsOf(MapLegend(content)), with_both);
  content.edges.clear();
  EXPECT_EQ(TextsOf(MapLegend(content)), kinds_only);
}

TEST(Legend, GoesOnInTheNextRowAndLeavesOutWhatHasNoSpace) {
  const MapContent content = test::ExampleContent();
  const auto height = [&](const LegendSpace& space) {
    return LegendRows(MapLegend(content), space).height_px();
  };
  EXPECT_EQ(height({5000.0, 5000.0, 9}), kLegendRowPx);
  EXPECT_GE(height({800.0, 800.0, 9}), 2.0 * kLegendRowPx);
  EXPECT_EQ(height({800.0, 800.0, 1}), kLegendRowPx);
  // Nothing fits beside the scale of a narrow picture.
  EXPECT_EQ(height({10.0, 5000.0, 9}), 2.0 * kLegendRowPx);
  EXPECT_EQ(height({10.0, 10.0, 9}), 0.0);
}

TEST(Names, MoveAsideBeforeTheyAreDropped) {
  const Eigen::AlignedBox2d area(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1000.0, 1000.0));
  picture::Canvas canvas(1000, 1000, picture::MakePaint(kPaperRgb));
  picture::LabelLayout layout(area);
  const Eigen::AlignedBox2d thing(Eigen::Vector2d(490.0, 490.0), Eigen::Vector2d(510.0, 510.0));
  layout.Block(thing);
  std::vector<Eigen::AlignedBox2d> spots;
  for (int i = 0; i < 8; ++i) {
    const std::optional<Eigen::AlignedBox2d> spot =
        WriteNameBeside(thing, {.text = "+90.9s", .dot_px = kAgentDotPx}, &layout, &canvas);
    ASSERT_TRUE(spot.has_value()) << i;
    EXPECT_FALSE(layout.IsFree(*spot));
    for (const Eigen::AlignedBox2d& other : spots) {
      EXPECT_LE(other.intersection(*spot).sizes().minCoeff(), 1e-9) << i;
    }
    spots.push_back(*spot);
  }
  layout.Block(area);
  EXPECT_FALSE(WriteNameBeside(thing, {.text = "+90.9s"}, &layout, &canvas).has_value());
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
  overlay.marks[1].shape = OverlayMark::Shape::kRing;
  overlay.legend = {{"way"},
                    {.text = "leaves", .shape = OverlayMark::Shape::kDot},
                    {.text = "enters", .shape = OverlayMark::Shape::kRing}};
  overlay.outlines = {{.height_m = 1.0}, {.height_m = 4.0}};
  KeepFloor({0.0, 3.0}, &overlay);
  ASSERT_EQ(overlay.lines.size(), 2u);
  EXPECT_EQ(overlay.lines[1].points_map.front().x(), 3.0);
  EXPECT_EQ(overlay.marks.size(), 1u);
  EXPECT_EQ(overlay.outlines.size(), 1u);
  ASSERT_EQ(overlay.legend.size(), 2u);
  EXPECT_EQ(overlay.legend[1].text, "leaves");
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
