// SPDX-License-Identifier: Apache-2.0
// A map of our own through a Spark-DSG file: what the format cannot say comes back all the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "schema/base/random.h"
#include "schema/interop/map_to_spark.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_writer.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

constexpr LayerId kLevels = 8;

Node NodeOf(char letter, uint64_t index, LayerId layer, const char* kind,
            const Eigen::Vector3d& position_map, double half_m) {
  Node node;
  node.id = NodeId(letter, index);
  node.layer = layer;
  node.kind = kind;
  node.name = ToString(node.id) + " there";
  node.map_T_node.position = position_map;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(half_m);
  if (half_m > 0.0) node.box_node = Box3d(-half, half);
  node.first_observed_ns = 1'000'000'000;
  node.last_observed_ns = 9'000'000'000;
  node.observation_count = 7;
  node.confidence = 0.75;
  node.provenance = Provenance::kPerceived;
  return node;
}

void AddPlacesAndRooms(MapContents* map) {
  Node building = NodeOf('B', 1, layers::kBuildings, kinds::kBuilding, {0, 0, 0}, 20.0);
  Node level = NodeOf('L', 1, kLevels, "level", {0, 0, 0}, 15.0);
  Node room = NodeOf('R', 1, layers::kRooms, kinds::kRoom, {0, 0, 1}, 8.0);
  room.region = RegionInfo{{{-8, -8}, {8, -8}, {8, 8}}, -7.0, 9.0, {{"kitchen", 0.5}}};
  room.class_id = 4;
  room.class_name = "kitchen";
  Node wall = NodeOf('S', 1, layers::kStructures, kinds::kStructure, {5, 0, 1}, 1.0);
  wall.structure = StructureInfo{"wall", {1, 0, 0}, -5.0, 12};
  map->nodes.insert(map->nodes.end(), {building, level, room, wall});
  for (uint64_t i = 0; i < 3; ++i) {
    Node place =
        NodeOf('p', i, layers::kPlaces, kinds::kPlace, {static_cast<double>(2 * i), 0.25, 1}, 0.5);
    place.place =
        PlaceInfo{0.5, Box3d(Eigen::Vector3d(-0.4, -0.4, -0.4), Eigen::Vector3d(0.4, 0.4, 0.4)), 3};
    map->nodes.push_back(place);
  }
}

void AddThings(MapContents* map) {
  Node chair = NodeOf('O', 1, layers::kObjects, kinds::kObject, {1, 1, 0.5}, 0.25);
  chair.map_T_node.orientation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
  chair.class_id = 56;
  chair.class_name = "chair";
  chair.object = ObjectInfo{};
  chair.object->model = Sha256{1, 2, 3};
  chair.object->size = {0.5, 0.5, 0.5};
  chair.attributes["colour"] = std::string("of oak");
  Node cup = NodeOf('O', 2, layers::kObjects, kinds::kObject, {1.1, 1, 1.1}, 0.05);
  cup.object = ObjectInfo{};
  cup.object->color = Color{200, 10, 10, 255};
  cup.valid = {2'000'000'000, 8'000'000'000};
  map->nodes.insert(map->nodes.end(), {chair, cup});
}

TrajectoryAppend WalkOf(NodeId agent, TimeNs first_ns) {
  TrajectoryAppend track;
  track.agent = agent;
  for (int i = 0; i < 40; ++i) {
    TimedPose pose;
    // Lost for five seconds in the middle.
    pose.time_ns = first_ns + TimeNs{i} * 100'000'000 + (i >= 20 ? 5'000'000'000 : 0);
    pose.map_T_agent.position = {0.25 * (i % 20), 0.25, 1.0};
    pose.map_T_agent.orientation = Eigen::AngleAxisd(0.125 * i, Eigen::Vector3d::UnitZ());
    track.poses.push_back(pose);
  }
  return track;
}

MapContents OwnMap() {
  MapContents map;
  map.spec.name = "office";
  map.revision = 12;
  map.layers = DefaultLayers();
  map.layers.push_back({kLevels, "levels", 450});
  AddPlacesAndRooms(&map);
  AddThings(&map);
  Node human = NodeOf('h', 3, layers::kAgents, kinds::kHuman, {4.75, 0.25, 1}, 0.0);
  human.agent = AgentInfo{std::nullopt, {0.5f, -1.5f}, "tracked", 3'000'000'000};
  Node robot = NodeOf('r', 2, layers::kAgents, kinds::kRobot, {4.75, 0.25, 1}, 0.0);
  robot.agent = AgentInfo{};
  map.nodes.insert(map.nodes.end(), {human, robot});
  map.tracks = {WalkOf(human.id, 1'000'000'000), WalkOf(robot.id, 2'000'000'000)};
  const auto edge = [&](NodeId source, const char* relation, NodeId target, double weight) {
    Edge made;
    made.source = source;
    made.relation = relation;
    made.target = target;
    made.weight = weight;
    map.edges.push_back(made);
  };
  edge({'B', 1}, relations::kContains, {'L', 1}, 1.0);
  edge({'L', 1}, relations::kContains, {'R', 1}, 1.0);
  edge({'R', 1}, relations::kContains, {'p', 0}, 1.0);
  edge({'R', 1}, relations::kContains, {'O', 1}, 1.0);
  edge({'p', 0}, relations::kTraversable, {'p', 1}, 0.75);
  edge({'p', 2}, relations::kTraversable, {'p', 1}, 0.75);
  edge({'O', 2}, relations::kOn, {'O', 1}, 1.0);
  edge({'O', 1}, relations::kLargerThan, {'O', 2}, 2.0);
  edge({'O', 2}, relations::kHeldBy, {'h', 3}, 1.0);
  edge({'S', 1}, relations::kEncloses, {'R', 1}, 1.0);
  edge({'O', 1}, relations::kCoVisible, {'r', 2}, 1.0);
  map.edges.back().valid = {1'000'000'000, 2'000'000'000};
  map.edges.back().attributes["why"] = std::string("seen");
  return map;
}

ImportedGraph ThroughFile(const MapContents& map, const PoseStep& step, SparkForm form) {
  const auto exported = MapToSpark(map, step);
  EXPECT_TRUE(exported.ok()) << exported.status();
  if (!exported.ok()) return {};
  EXPECT_TRUE(exported->notes.empty());
  auto imported = ReadSceneGraph(SparkToBytes(exported->graph, form), "office", 2.0);
  EXPECT_TRUE(imported.ok()) << imported.status();
  return imported.ok() ? *std::move(imported) : ImportedGraph();
}

class OwnMapExport : public testing::TestWithParam<SparkForm> {};

TEST_P(OwnMapExport, BringsEveryFieldOfEveryNodeBack) {
  const MapContents map = OwnMap();
  const ImportedGraph again = ThroughFile(map, {}, GetParam());
  std::map<NodeId, nlohmann::json> found;
  const auto items = NodesToJson(again.delta.nodes, again.delta.layers);
  for (size_t i = 0; i < items.size(); ++i) found[again.delta.nodes[i].id] = items[i];
  const auto wanted = NodesToJson(map.nodes, map.layers);
  EXPECT_EQ(found.size(), wanted.size());
  for (size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(found[map.nodes[i].id].dump(1), wanted[i].dump(1));
  }
}

TEST_P(OwnMapExport, BringsEveryEdgeBackAlsoWhereAPairHasSeveral) {
  const MapContents map = OwnMap();
  ImportedGraph again = ThroughFile(map, {}, GetParam());
  const auto sorted = [](std::vector<Edge> edges) {
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.key() < b.key(); });
    std::vector<std::string> texts;
    for (const auto& item : EdgesToJson(edges)) texts.push_back(item.dump());
    return texts;
  };
  EXPECT_EQ(sorted(again.delta.edges), sorted(map.edges));
}

TEST_P(OwnMapExport, KeepsTracksAsThinAsAskedFor) {
  const MapContents map = OwnMap();
  const ImportedGraph whole = ThroughFile(map, {.distance_m = 0.0}, GetParam());
  ASSERT_EQ(whole.delta.appends.size(), 2u);
  for (const TrajectoryAppend& track : whole.delta.appends) {
    const auto& poses = map.tracks[track.agent.letter() == 'h' ? 0 : 1].poses;
    ASSERT_EQ(track.poses.size(), poses.size());
    for (size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(track.poses[i].time_ns, poses[i].time_ns);
      EXPECT_LT((track.poses[i].map_T_agent.position - poses[i].map_T_agent.position).norm(), 1e-6);
    }
  }
  const ImportedGraph thin = ThroughFile(map, {}, GetParam());
  ASSERT_EQ(thin.delta.appends.size(), 2u);
  for (const TrajectoryAppend& track : thin.delta.appends) {
    EXPECT_EQ(track.poses.size(), 22u) << ToString(track.agent);
    EXPECT_EQ(track.poses.back().map_T_agent.position.x(), 4.75);
  }
}

TEST_P(OwnMapExport, TellsWhoWasInTheRoom) {
  const ImportedGraph again = ThroughFile(OwnMap(), {}, GetParam());
  for (const NodeId agent : {NodeId('h', 3), NodeId('r', 2)}) {
    const auto& stays = again.delta.stays;
    EXPECT_TRUE(std::any_of(stays.begin(), stays.end(), [&](const Stay& stay) {
      return stay.agent == agent && stay.place == NodeId('p', 0) && stay.room == NodeId('R', 1);
    })) << ToString(agent);
  }
}

TEST_P(OwnMapExport, IsTheSameBytesEachTime) {
  const auto first = MapToSpark(OwnMap(), {});
  const auto second = MapToSpark(OwnMap(), {});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(SparkToBytes(first->graph, GetParam()), SparkToBytes(second->graph, GetParam()));
}

TEST_P(OwnMapExport, CutAnywhereIsRefusedAndNeverCrashes) {
  const auto exported = MapToSpark(OwnMap(), {});
  ASSERT_TRUE(exported.ok());
  std::string bytes = SparkToBytes(exported->graph, GetParam());
  while (bytes.back() == '\n') bytes.pop_back();
  for (size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 700) {
    EXPECT_FALSE(ReadSceneGraph(bytes.substr(0, size), "cut", 2.0).ok()) << size;
  }
}

TEST_P(OwnMapExport, AlteredAnywhereIsReadOrRefusedAndNeverCrashes) {
  const uint64_t seed = 20200719;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  const auto exported = MapToSpark(OwnMap(), {});
  ASSERT_TRUE(exported.ok());
  const std::string bytes = SparkToBytes(exported->graph, GetParam());
  Random random(seed, 0);
  int64_t read_count = 0;
  for (int i = 0; i < 600; ++i) {
    std::string altered = bytes;
    for (int k = 0; k < 3; ++k) {
      const size_t at = static_cast<size_t>(random.Index(static_cast<int>(altered.size())));
      altered[at] = static_cast<char>(random.Index(256));
    }
    const auto imported = ReadSceneGraph(altered, "altered", 2.0);
    read_count += imported.ok() ? 1 : 0;
    // Whatever was read must also stand an export.
    if (!imported.ok() || !CheckImport(*imported).ok()) continue;
    MapContents map;
    map.layers = DefaultLayers();
    map.layers.insert(map.layers.end(), imported->delta.layers.begin(),
                      imported->delta.layers.end());
    map.nodes = imported->delta.nodes;
    map.edges = imported->delta.edges;
    map.tracks = imported->delta.appends;
    const auto again = MapToSpark(map, {});
    if (again.ok()) SparkToBytes(again->graph, SparkForm::kBinary);
  }
  EXPECT_GT(read_count, 0);
}

INSTANTIATE_TEST_SUITE_P(Both, OwnMapExport, testing::Values(SparkForm::kJson, SparkForm::kBinary),
                         [](const auto& form) {
                           return form.param == SparkForm::kJson ? "Json" : "Binary";
                         });

TEST(MapToSpark, PutsLevelsBetweenRoomsAndBuildings) {
  const auto exported = MapToSpark(OwnMap(), {});
  ASSERT_TRUE(exported.ok());
  const auto& names = exported->graph.layer_names;
  EXPECT_EQ(names.at("OBJECTS"), (SparkLayerKey{2, 0}));
  EXPECT_EQ(names.at("STRUCTURES"), (SparkLayerKey{3, 2}));
  EXPECT_EQ(names.at("ROOMS"), (SparkLayerKey{4, 0}));
  EXPECT_EQ(names.at("levels"), (SparkLayerKey{5, 0}));
  EXPECT_EQ(names.at("BUILDINGS"), (SparkLayerKey{6, 0}));
}

TEST(MapToSpark, IgnoresBrokenRestsOfAnybody) {
  MapContents map = OwnMap();
  const char* const rests[] = {"{\"fields\":",
                               "7",
                               "zAAAA",
                               "z!",
                               "{\"type\":\"Wall\",\"key\":7}",
                               "{\"fields\":{\"position\":[null,\"x\"],\"name\":[1,2,3]}}"};
  for (size_t i = 0; i < std::size(rests); ++i) {
    map.nodes[i].attributes["spark_dsg"] = std::string(rests[i]);
    map.nodes[i].attributes["spark_dsg_graph"] = std::string(rests[i]);
  }
  map.nodes[0].attributes["metadata"] = std::string("{{{");
  const ImportedGraph again = ThroughFile(map, {}, SparkForm::kBinary);
  EXPECT_EQ(again.delta.nodes.size(), map.nodes.size());
}

}  // namespace
}  // namespace dsg
