// SPDX-License-Identifier: Apache-2.0
// The scene graph of a world satisfies the store's invariants and says what the world holds.
#include "ingest/simulator/world/world_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "schema/codec/proto_convert.h"
#include "schema/model/delta_check.h"

namespace dsg::simulator {
namespace {

/// A map with the default layers and nothing else.
class EmptyMap : public GraphLookup {
 public:
  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId) const override { return std::nullopt; }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const Layer& layer : DefaultLayers()) {
      if (layer.id == id) return layer;
    }
    return std::nullopt;
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId) const override {
    return std::vector<NodeId>();
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId) const override {
    return std::vector<NodeId>();
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId) const override { return std::nullopt; }
  absl::StatusOr<bool> HasAsset(const Sha256&) const override { return false; }
};

constexpr WorldKind kAllKinds[] = {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment};

World MakeWorld(WorldKind kind, uint64_t seed) {
  auto world = GenerateWorld({kind, seed});
  EXPECT_TRUE(world.ok()) << world.status();
  return *std::move(world);
}

TEST(WorldGraph, PassesTheChecksOfTheStoreOnAnEmptyMap) {
  for (const WorldKind kind : kAllKinds) {
    for (uint64_t seed = 1; seed <= 5; ++seed) {
      GraphDelta delta = WorldGraph(MakeWorld(kind, seed));
      delta.map = "simulated";
      delta.session_id = "test";
      delta.sequence = 1;
      Coalesce(&delta);
      const absl::Status status = CheckDelta(delta, EmptyMap());
      EXPECT_TRUE(status.ok()) << "seed " << seed << ": " << status;
    }
  }
}

TEST(WorldGraph, SurvivesJson) {
  const GraphDelta delta = WorldGraph(MakeWorld(WorldKind::kWing, 3));
  const std::string json = DeltaToJson(delta);
  const auto back = DeltaFromJson(json);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->nodes.size(), delta.nodes.size());
  EXPECT_EQ(back->edges.size(), delta.edges.size());
  EXPECT_EQ(back->labels, delta.labels);
  // Not EXPECT_EQ, which would look for the shortest difference of two megabytes.
  EXPECT_TRUE(DeltaToJson(*back) == json);
}

TEST(WorldGraph, GivesEachNodeOneParentInTheRightLayer) {
  const World world = MakeWorld(WorldKind::kOffice, 4);
  const GraphDelta delta = WorldGraph(world);
  std::map<NodeId, NodeId> parent;
  std::map<std::string, int> relation_count;
  for (const Edge& edge : delta.edges) {
    ++relation_count[edge.relation];
    if (edge.relation != relations::kContains) continue;
    EXPECT_TRUE(parent.emplace(edge.target, edge.source).second) << ToString(edge.target);
  }
  const std::map<char, char> parent_letter = {{'O', 'p'}, {'p', 'R'}, {'R', 'B'}};
  for (const Node& node : delta.nodes) {
    const auto letter = parent_letter.find(node.id.letter());
    if (letter == parent_letter.end()) continue;
    ASSERT_TRUE(parent.count(node.id)) << ToString(node.id);
    EXPECT_EQ(parent[node.id].letter(), letter->second);
  }
  // An object is in a place of the room it stands in.
  for (size_t i = 0; i < world.furniture.size(); ++i) {
    const NodeId place = parent[ObjectId(static_cast<int>(i))];
    EXPECT_EQ(parent[place], RoomId(world.furniture[i].room));
  }
  EXPECT_EQ(relation_count[relations::kAdjacent], static_cast<int>(world.plan.doors.size()));
  EXPECT_EQ(relation_count[relations::kEncloses], static_cast<int>(world.plan.structures.size()));
  EXPECT_EQ(relation_count[relations::kTraversable], static_cast<int>(world.places.edges.size()));
  EXPECT_GT(relation_count[relations::kOn], 0);
}

TEST(WorldGraph, KeepsRoomBoxesAtTheirWalls) {
  const World world = MakeWorld(WorldKind::kOffice, 5);
  for (const Node& node : WorldGraph(world).nodes) {
    if (node.kind != kinds::kRoom) continue;
    const Rect& cell = world.plan.rooms[node.id.index()].cell;
    const Box3d box = node.BoxMap();
    EXPECT_NEAR(box.min().x(), cell.min().x(), 1e-9);
    EXPECT_NEAR(box.max().y(), cell.max().y(), 1e-9);
    EXPECT_NEAR(box.max().z(), world.plan.rooms[node.id.index()].ceiling_m, 1e-9);
    EXPECT_TRUE(PolygonContains(node.region->footprint_map, cell.center()));
  }
}

TEST(WorldGraph, IsTheSameBytesForTheSameSeed) {
  for (const WorldKind kind : kAllKinds) {
    const std::string one = DeltaToJson(WorldGraph(MakeWorld(kind, 7)));
    const std::string two = DeltaToJson(WorldGraph(MakeWorld(kind, 7)));
    EXPECT_TRUE(one == two) << Name(kind);
  }
}

TEST(WorldGraph, JoinsTheRoomsOfEachDoor) {
  const World world = MakeWorld(WorldKind::kOffice, 8);
  std::multiset<std::pair<NodeId, NodeId>> edges;
  for (const Edge& edge : WorldGraph(world).edges) {
    if (edge.relation == relations::kAdjacent) edges.insert({edge.source, edge.target});
  }
  for (const Door& door : world.plan.doors) {
    EXPECT_EQ(edges.count({RoomId(door.room_a), RoomId(door.room_b)}), 1u);
  }
}

TEST(WorldGraph, PutsStructurePlanesOnTheInnerFaces) {
  for (const WorldKind kind : {WorldKind::kApartment, WorldKind::kOffice}) {
    const World world = MakeWorld(kind, 6);
    int checked = 0;
    for (const Node& node : WorldGraph(world).nodes) {
      if (node.kind != kinds::kStructure) continue;
      const StructureInfo& info = *node.structure;
      const Structure& part = world.plan.structures[node.id.index()];
      if (part.type == "pillar") continue;
      const Room& room = world.plan.rooms[static_cast<size_t>(part.room)];
      const Point center = room.cell.center();
      const Eigen::Vector3d inside(center.x(), center.y(), 0.5 * room.ceiling_m);
      EXPECT_GT(info.plane_normal_map.dot(inside) + info.plane_offset_m, 0.5) << node.name;
      // The slab lies behind its plane and touches it.
      const Box3d box = node.BoxMap();
      double nearest = -1e9;
      for (const auto corner : {Box3d::BottomLeftFloor, Box3d::TopRightCeil}) {
        nearest =
            std::max(nearest, info.plane_normal_map.dot(box.corner(corner)) + info.plane_offset_m);
      }
      EXPECT_NEAR(nearest, 0.0, 1e-9) << node.name;
      ++checked;
    }
    EXPECT_GT(checked, 30);
  }
}

}  // namespace
}  // namespace dsg::simulator
