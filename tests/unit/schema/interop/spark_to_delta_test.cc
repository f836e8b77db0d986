// SPDX-License-Identifier: Apache-2.0
// Layers, relations, boxes, classes and times of an imported Spark-DSG graph.
#include "schema/interop/spark_to_delta.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

ImportedGraph Convert(const SparkGraph& graph) {
  auto imported = SparkToDelta(graph, "g.json", 2.0);
  EXPECT_TRUE(imported.ok()) << imported.status();
  if (!imported.ok()) return {};
  EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
  return *std::move(imported);
}

const Edge* FindEdge(const ImportedGraph& imported, const std::string& source,
                     const std::string& relation, const std::string& target) {
  for (const Edge& edge : imported.delta.edges) {
    if (ToString(edge.source) == source && edge.relation == relation &&
        ToString(edge.target) == target) {
      return &edge;
    }
  }
  return nullptr;
}

SparkGraph OneObject() {
  SparkGraph graph;
  SparkNode object;
  object.id = NodeId('O', 1).value;
  object.key = {2, 0};
  object.type = SparkClass::kObject;
  object.position = {10, 20, 30};
  graph.nodes = {object};
  return graph;
}

TEST(SparkToDelta, PutsEveryLayerWhereItBelongs) {
  const ImportedGraph imported = Convert(SampleSparkGraph());
  EXPECT_EQ(NodeNamed(imported, "O1").layer, layers::kObjects);
  EXPECT_EQ(NodeNamed(imported, "O2").kind, kinds::kObject);
  EXPECT_EQ(NodeNamed(imported, "p0").layer, layers::kPlaces);
  EXPECT_EQ(NodeNamed(imported, "P7").kind, kinds::kPlace);
  EXPECT_EQ(NodeNamed(imported, "R0").kind, kinds::kRoom);
  EXPECT_EQ(NodeNamed(imported, "B0").kind, kinds::kBuilding);
  EXPECT_EQ(NodeNamed(imported, "a1").kind, "agent_pose");
  EXPECT_EQ(NodeNamed(imported, "a1").layer, 20);
  EXPECT_EQ(NodeNamed(imported, "C0").layer, 10004);
  EXPECT_EQ(NodeNamed(imported, "t0").layer, 4002);
  const std::vector<Layer> expected = {
      {20, "agent_poses", 200}, {4002, "layer_3_2", 300}, {10004, "CITY", 900}};
  EXPECT_EQ(imported.delta.layers, expected);
}

TEST(SparkToDelta, RelatesByTheLayersOfTheEnds) {
  const ImportedGraph imported = Convert(SampleSparkGraph());
  EXPECT_EQ(imported.delta.edges.size(), 7u);
  EXPECT_NE(FindEdge(imported, "a0", "NEAREST_PLACE", "p0"), nullptr);
  EXPECT_NE(FindEdge(imported, "a0", "ODOMETRY", "a1"), nullptr);
  EXPECT_NE(FindEdge(imported, "R0", "CONTAINS", "p0"), nullptr);
  EXPECT_NE(FindEdge(imported, "B0", "CONTAINS", "R0"), nullptr);
  EXPECT_NE(FindEdge(imported, "C0", "CONTAINS", "B0"), nullptr);
  EXPECT_NE(FindEdge(imported, "P7", "NEAR", "p0"), nullptr);
  const Edge* object = FindEdge(imported, "p0", "CONTAINS", "O1");
  ASSERT_NE(object, nullptr);
  EXPECT_EQ(object->weight, 0.5);
  EXPECT_EQ(std::get<std::string>(object->attributes.at("metadata")), "{\"b\":[1,2]}");
}

TEST(SparkToDelta, NamesSiblingsByTheirLayer) {
  SparkGraph graph;
  const auto add = [&](SparkClass type, char letter, uint64_t index, int64_t layer) {
    SparkNode node;
    node.type = type;
    node.id = NodeId(letter, index).value;
    node.key = {layer, 0};
    graph.nodes.push_back(node);
  };
  for (const uint64_t i : {0, 1}) {
    add(SparkClass::kPlace, 'p', i, 3);
    add(SparkClass::kRoom, 'R', i, 4);
    add(SparkClass::kObject, 'O', i, 2);
  }
  for (const char letter : {'p', 'R', 'O'}) {
    graph.edges.push_back({NodeId(letter, 1).value, NodeId(letter, 0).value, true, 0.7, ""});
  }
  const ImportedGraph imported = Convert(graph);
  ASSERT_NE(FindEdge(imported, "p0", "TRAVERSABLE", "p1"), nullptr);
  EXPECT_EQ(FindEdge(imported, "p0", "TRAVERSABLE", "p1")->weight, 0.7);
  EXPECT_NE(FindEdge(imported, "R0", "ADJACENT", "R1"), nullptr);
  EXPECT_NE(FindEdge(imported, "O0", "NEAR", "O1"), nullptr);
}

TEST(SparkToDelta, KeepsAllParentsOfANode) {
  SparkGraph graph = SampleSparkGraph();
  graph.edges.push_back({NodeId('P', 7).value, NodeId('O', 1).value, false, 1.0, ""});
  const ImportedGraph imported = Convert(graph);
  EXPECT_NE(FindEdge(imported, "p0", "CONTAINS", "O1"), nullptr);
  EXPECT_NE(FindEdge(imported, "P7", "CONTAINS", "O1"), nullptr);
}

TEST(SparkToDelta, TurnsAWorldBoxIntoTheFrameOfARegisteredObject) {
  SparkGraph graph = OneObject();
  const double half_sqrt = std::numbers::sqrt2 / 2;
  // The object is turned by 90 degrees, the box by 45.
  graph.nodes[0].orientation = {half_sqrt, 0, 0, half_sqrt};
  graph.nodes[0].box.type = SparkBox::Type::kOriented;
  graph.nodes[0].box.dimensions = {2, 2, 4};
  graph.nodes[0].box.center = {11, 20, 30};
  graph.nodes[0].box.rotation =
      Eigen::AngleAxisf(std::numbers::pi_v<float> / 4, Eigen::Vector3f::UnitZ()).toRotationMatrix();
  const ImportedGraph imported = Convert(graph);
  const Node& node = NodeNamed(imported, "O1");
  // One metre along the map's x is one metre along the object's -y.
  EXPECT_LT((node.box_node.center() - Eigen::Vector3d(0, -1, 0)).norm(), 1e-6);
  const Eigen::Vector3d expected(2 * std::numbers::sqrt2, 2 * std::numbers::sqrt2, 4);
  EXPECT_LT((node.box_node.sizes() - expected).norm(), 1e-5);
  EXPECT_EQ(node.object->size, Eigen::Vector3d(2, 2, 4));
}

TEST(SparkToDelta, TakesTheRotationOfAnAlignedBoxForNothing) {
  SparkGraph graph = OneObject();
  graph.nodes[0].box.type = SparkBox::Type::kAligned;
  graph.nodes[0].box.dimensions = {2, 4, 6};
  graph.nodes[0].box.center = {10, 20, 30};
  graph.nodes[0].box.rotation.setConstant(NAN);
  const ImportedGraph imported = Convert(graph);
  EXPECT_EQ(NodeNamed(imported, "O1").box_node.sizes(), Eigen::Vector3d(2, 4, 6));
}

TEST(SparkToDelta, LeavesOutARoomsBoxThatDoesNotHoldTheRoom) {
  SparkGraph graph = SampleSparkGraph();
  SparkNode& room = graph.nodes[6];
  room.box.type = SparkBox::Type::kAligned;
  room.box.dimensions = {0.1f, 0.1f, 0.1f};
  room.box.center = {0.05f, 0.05f, 0.05f};
  const ImportedGraph dropped = Convert(graph);
  EXPECT_TRUE(NodeNamed(dropped, "R0").region->footprint_map.empty());
  room.box.dimensions = {8, 8, 3};
  const ImportedGraph kept = Convert(graph);
  const RegionInfo& region = *NodeNamed(kept, "R0").region;
  EXPECT_EQ(region.footprint_map.size(), 4u);
  EXPECT_FLOAT_EQ(static_cast<float>(region.z_max_m), 1.55f);
  EXPECT_EQ(region.class_probabilities.at("office"), 0.75);
}

TEST(SparkToDelta, NamesClassesFromTheLabelSpaceOfTheLayer) {
  const ImportedGraph imported = Convert(SampleSparkGraph());
  EXPECT_EQ(NodeNamed(imported, "O1").class_name, "chair");
  EXPECT_EQ(NodeNamed(imported, "R0").class_name, "office");
  EXPECT_EQ(NodeNamed(imported, "p0").class_name, "");
  EXPECT_EQ(NodeNamed(imported, "p0").class_id, 5);
  EXPECT_EQ(NodeNamed(imported, "C0").class_id, -1);
  const std::vector<SemanticLabel> expected = {{4, "lamp"}, {5, "chair"}};
  EXPECT_EQ(imported.delta.labels, expected);
}

TEST(SparkToDelta, KeepsComponentsTimesAndAttributes) {
  const ImportedGraph imported = Convert(SampleSparkGraph());
  const Node& place = NodeNamed(imported, "p0");
  EXPECT_EQ(place.place->clearance_m, 0.75);
  EXPECT_EQ(place.place->basis_point_count, 4);
  EXPECT_EQ(place.provenance, Provenance::kPredicted);
  EXPECT_EQ(std::get<std::string>(place.attributes.at("color")), "#01020304");
  const Node& flat = NodeNamed(imported, "P7");
  EXPECT_EQ(flat.region->footprint_map.size(), 3u);
  EXPECT_EQ(flat.region->z_min_m, 0.1);
  EXPECT_EQ(flat.region->z_max_m, 0.3);
  const Node& object = NodeNamed(imported, "O1");
  EXPECT_EQ(object.provenance, Provenance::kImported);
  EXPECT_EQ(object.last_observed_ns, 1'500'000'000);
  EXPECT_EQ(object.object->color, (Color{1, 2, 3, 4}));
  EXPECT_EQ(std::get<double>(object.attributes.at("mesh_connections")), 3.0);
  const Node& khronos = NodeNamed(imported, "O2");
  EXPECT_EQ(khronos.first_observed_ns, 1'000'000'000);
  EXPECT_EQ(khronos.last_observed_ns, 4'000'000'000);
  EXPECT_EQ(std::get<std::string>(khronos.attributes.at("presence_ns")),
            "1000000000-2000000000 3000000000-4000000000");
}

TEST(SparkToDelta, CountsInTheFilesTermsAndCutsTheMeshIntoBlocks) {
  const ImportedGraph imported = Convert(SampleSparkGraph());
  EXPECT_EQ(imported.node_count, 10);
  EXPECT_EQ(imported.edge_count, 7);
  EXPECT_EQ(imported.pose_count, 2);
  EXPECT_EQ(imported.mesh_vertex_count, 3);
  EXPECT_EQ(imported.mesh_face_count, 1);
  EXPECT_EQ(imported.first_ns, 1'000'000'000);
  ASSERT_EQ(imported.delta.mesh_blocks.size(), 1u);
  EXPECT_EQ(imported.delta.mesh_blocks[0].first_seen_ns, (std::vector<TimeNs>{10, 20, 30}));
}

TEST(SparkToDelta, DropsUpdateTimesThatNoRobotOfTheFileSaw) {
  SparkGraph graph = SampleSparkGraph();
  graph.nodes[0].last_update_ns = 112;
  graph.nodes[4].last_update_ns = 13816972410777187123u;
  const ImportedGraph imported = Convert(graph);
  EXPECT_FALSE(NodeNamed(imported, "O1").last_observed_ns.has_value());
  EXPECT_FALSE(NodeNamed(imported, "p0").last_observed_ns.has_value());
  EXPECT_NE(imported.notes.end(),
            std::find_if(imported.notes.begin(), imported.notes.end(), [](const auto& note) {
              return note.find("2 update times") != std::string::npos;
            }));
}

TEST(SparkToDelta, SkipsWhatCannotBeNamingTheNodeOrEdge) {
  using Break = void (*)(SparkGraph*);
  const std::pair<const char*, Break> cases[] = {
      {"node O1: position", [](SparkGraph* g) { g->nodes[0].position.x() = NAN; }},
      {"node O1: position", [](SparkGraph* g) { g->nodes[0].position.z() = 3e6; }},
      {"node O1: bounding_box", [](SparkGraph* g) { g->nodes[0].box.dimensions.x() = NAN; }},
      {"node p0: distance", [](SparkGraph* g) { g->nodes[4].distance = INFINITY; }},
      {"node P7: boundary", [](SparkGraph* g) { g->nodes[5].boundary[1].y() = NAN; }},
      {"node R0: probability",
       [](SparkGraph* g) { g->nodes[6].class_probabilities["office"] = NAN; }},
      {"node O1: appears twice", [](SparkGraph* g) { g->nodes.push_back(g->nodes[0]); }},
      {"node id 5", [](SparkGraph* g) { g->nodes[0].id = 5; }},
      {"node O1: name has", [](SparkGraph* g) { g->nodes[0].name.assign(2000, 'x'); }},
      {"node O1: layer -3", [](SparkGraph* g) { g->nodes[0].key.layer = -3; }},
      {"node O1: layer 2 partition 5000", [](SparkGraph* g) { g->nodes[0].key.partition = 5000; }},
      {"node a0: timestamp", [](SparkGraph* g) { g->nodes[2].stamp_ns = kTimeMax; }},
      {"(Z9) is not in the file", [](SparkGraph* g) { g->edges[0].target = NodeId('Z', 9).value; }},
      {"ends where it begins", [](SparkGraph* g) { g->edges[0].source = g->edges[0].target; }},
      {"a0 to p0: appears twice",
       [](SparkGraph* g) {
         g->edges.push_back({g->edges[0].target, g->edges[0].source, false, 1.0, ""});
       }},
      {"edge p0 to a0: weight", [](SparkGraph* g) { g->edges[0].weight = NAN; }},
      {"mesh vertex 1", [](SparkGraph* g) { g->mesh->positions_map[1].x() = NAN; }},
      {"mesh face 0: has vertex 3", [](SparkGraph* g) { g->mesh->faces[0][2] = 3; }},
  };
  for (const auto& [named, damage] : cases) {
    SCOPED_TRACE(named);
    SparkGraph graph = SampleSparkGraph();
    damage(&graph);
    const ImportedGraph imported = Convert(graph);
    ExpectSkipped(imported.skipped, named);
    const bool is_whole_node = imported.node_count < 10;
    EXPECT_EQ(imported.node_count + (is_whole_node ? 1 : 0), 10);
    EXPECT_GE(imported.edge_count, is_whole_node ? 4 : 6);
  }
}

TEST(SparkToDelta, LeavesOutAMeshChannelOfAnotherLength) {
  SparkGraph graph = SampleSparkGraph();
  graph.mesh->labels.pop_back();
  const ImportedGraph imported = Convert(graph);
  EXPECT_TRUE(imported.delta.mesh_blocks[0].labels.empty());
  EXPECT_FALSE(imported.delta.mesh_blocks[0].colors.empty());
}

}  // namespace
}  // namespace dsg
