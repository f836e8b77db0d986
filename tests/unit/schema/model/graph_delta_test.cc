// SPDX-License-Identifier: Apache-2.0
#include "schema/model/graph_delta.h"

#include <gtest/gtest.h>

#include "schema/model/delta_check.h"

namespace dsg {
namespace {

Node MakeNode(NodeId id, LayerId layer, const char* kind) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  return node;
}

TEST(FitBoxesToChildren, GrowsEveryAncestorOverATurnedChild) {
  GraphDelta delta;
  Node building = MakeNode(NodeId('B', 0), layers::kBuildings, kinds::kBuilding);
  Node room = MakeNode(NodeId('R', 0), layers::kRooms, kinds::kRoom);
  room.map_T_node = {{5, 5, 0},
                     Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()))};
  room.box_node = Box3d(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 1));
  Node place = MakeNode(NodeId('p', 0), layers::kPlaces, kinds::kPlace);
  place.map_T_node.position = {9, 2, 4};
  delta.nodes = {building, room, place};
  delta.edges = {{building.id, relations::kContains, room.id},
                 {room.id, relations::kContains, place.id}};

  FitBoxesToChildren(&delta);

  const Box3d room_map = delta.nodes[1].BoxMap();
  EXPECT_TRUE(room_map.contains(Eigen::Vector3d(9, 2, 4)));
  const Box3d building_map = delta.nodes[0].BoxMap();
  EXPECT_LE((building_map.min() - room_map.min()).maxCoeff(), kBoxToleranceM);
  EXPECT_LE((room_map.max() - building_map.max()).maxCoeff(), kBoxToleranceM);
}

TEST(SplitDelta, PutsParentsFirstAndNodesBeforeTheirEdges) {
  GraphDelta delta;
  delta.session_id = "s";
  delta.sequence = 5;
  for (uint64_t i = 0; i < 10; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace));
  }
  delta.nodes.push_back(MakeNode(NodeId('R', 0), layers::kRooms, kinds::kRoom));
  for (uint64_t i = 0; i < 10; ++i) {
    delta.edges.push_back({NodeId('R', 0), relations::kContains, NodeId('p', i)});
  }
  const auto parts = SplitDelta(delta, 4);
  ASSERT_EQ(parts.size(), 6u);
  EXPECT_EQ(parts[0].nodes.front().id, NodeId('R', 0));
  for (size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(parts[i].sequence, 5 + static_cast<int64_t>(i));
    EXPECT_LE(parts[i].nodes.size() + parts[i].edges.size(), 4u);
  }
  EXPECT_TRUE(parts[1].edges.empty());
  EXPECT_EQ(parts.back().edges.size(), 1u);
}

TEST(SplitDelta, CutsLongTracksWithoutLosingAPose) {
  GraphDelta delta;
  delta.appends.push_back({NodeId('H', 1), std::vector<TimedPose>(1000)});
  size_t count = 0;
  for (const GraphDelta& part : SplitDelta(delta, 64)) {
    ASSERT_EQ(part.appends.size(), 1u);
    EXPECT_LE(part.appends[0].poses.size(), 64u);
    count += part.appends[0].poses.size();
  }
  EXPECT_EQ(count, 1000u);
}

TEST(SplitDelta, CutsShapesAndRepeatsTheirTopology) {
  GraphDelta delta;
  delta.shapes.push_back({NodeId('H', 1), Sha256{7}, std::vector<BodyShape>(100)});
  size_t count = 0;
  for (const GraphDelta& part : SplitDelta(delta, 32)) {
    ASSERT_EQ(part.shapes.size(), 1u);
    EXPECT_EQ(part.shapes[0].topology, Sha256{7});
    EXPECT_LE(part.shapes[0].shapes.size(), 32u);
    count += part.shapes[0].shapes.size();
  }
  EXPECT_EQ(count, 100u);
}

TEST(Coalesce, JoinsShapesByTopologyAndKeepsTheLastWordOnEachTime) {
  const auto body = [](TimeNs time_ns, float number) {
    BodyShape shape;
    shape.time_ns = time_ns;
    shape.joints = {number, 0.0f, 0.0f};
    return shape;
  };
  GraphDelta delta;
  delta.shapes = {{NodeId('H', 1), Sha256{1}, {body(10, 1), body(20, 1)}},
                  {NodeId('H', 1), Sha256{2}, {body(20, 2)}},
                  {NodeId('H', 1), Sha256{1}, {body(5, 3), body(20, 3)}}};
  Coalesce(&delta);
  ASSERT_EQ(delta.shapes.size(), 2u);
  ASSERT_EQ(delta.shapes[0].shapes.size(), 3u);
  EXPECT_EQ(delta.shapes[0].shapes[0].time_ns, 5);
  EXPECT_EQ(delta.shapes[0].shapes[1].joints[0], 1.0f);
  EXPECT_EQ(delta.shapes[0].shapes[2].joints[0], 3.0f);
  EXPECT_EQ(delta.shapes[1].topology, Sha256{2});
}

TEST(Coalesce, KeepsTheLastWordOnEachEntity) {
  GraphDelta delta;
  Node first = MakeNode(NodeId('p', 1), layers::kPlaces, kinds::kPlace);
  Node second = first;
  second.name = "later";
  delta.nodes = {MakeNode(NodeId('p', 2), layers::kPlaces, kinds::kPlace), first, second};
  delta.edges = {{NodeId('p', 1), relations::kTraversable, NodeId('p', 2), 1.0},
                 {NodeId('p', 1), relations::kTraversable, NodeId('p', 2), 2.0},
                 {NodeId('p', 2), relations::kTraversable, NodeId('p', 1), 3.0}};
  delta.edge_removals = {{NodeId('p', 2), relations::kTraversable, NodeId('p', 1)}};
  delta.appends = {{NodeId('H', 1), std::vector<TimedPose>(2)},
                   {NodeId('H', 1), std::vector<TimedPose>(3)}};

  Coalesce(&delta);

  ASSERT_EQ(delta.nodes.size(), 2u);
  EXPECT_EQ(delta.nodes[0].name, "later");
  ASSERT_EQ(delta.edges.size(), 1u);
  EXPECT_EQ(delta.edges[0].weight, 2.0);
  ASSERT_EQ(delta.appends.size(), 1u);
  EXPECT_EQ(delta.appends[0].poses.size(), 5u);
}

}  // namespace
}  // namespace dsg
