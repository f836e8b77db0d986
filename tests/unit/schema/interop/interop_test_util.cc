// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/interop/interop_test_util.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace dsg {

absl::StatusOr<std::optional<GraphLookup::NodeFacts>> EmptyMap::FindNode(NodeId) const {
  return std::nullopt;
}
absl::StatusOr<std::optional<Layer>> EmptyMap::FindLayer(LayerId id) const {
  for (const Layer& layer : DefaultLayers()) {
    if (layer.id == id) return layer;
  }
  return std::nullopt;
}
absl::StatusOr<std::vector<NodeId>> EmptyMap::FindParents(NodeId) const {
  return std::vector<NodeId>();
}
absl::StatusOr<std::vector<NodeId>> EmptyMap::FindChildren(NodeId) const {
  return std::vector<NodeId>();
}
absl::StatusOr<std::optional<TimeNs>> EmptyMap::FindTrackEnd(NodeId) const { return std::nullopt; }
absl::StatusOr<bool> EmptyMap::HasAsset(const Sha256&) const { return false; }

absl::Status CheckImport(const ImportedGraph& imported) {
  GraphDelta delta = imported.delta;
  delta.map = "m";
  delta.session_id = "s";
  delta.sequence = 1;
  return CheckDelta(delta, EmptyMap());
}

std::string ReadDataFile(const std::string& path) {
  const char* folder = std::getenv("DSG_DATA");
  const std::string root = folder != nullptr ? folder : DSG_SOURCE_DIR "/../shared/data";
  std::ifstream stream(root + "/" + path, std::ios::binary);
  std::stringstream bytes;
  if (stream) bytes << stream.rdbuf();
  return bytes.str();
}

void ExpectMalformed(const absl::Status& status, const std::string& part) {
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
  EXPECT_NE(std::string(status.message()).find(part), std::string::npos) << status;
}

void ExpectSkipped(const std::vector<Skipped>& skipped, const std::string& part) {
  std::string all;
  for (const Skipped& one : skipped) all += ToString(one) + "\n";
  EXPECT_NE(all.find(part), std::string::npos) << "not there: " << part << "\n" << all;
}

const Node& NodeNamed(const ImportedGraph& imported, const std::string& id) {
  for (const Node& node : imported.delta.nodes) {
    if (ToString(node.id) == id) return node;
  }
  ADD_FAILURE() << "no node " << id;
  static const Node none;
  return none;
}

namespace {

SparkNode SparkNodeOf(SparkClass type, char letter, uint64_t index, SparkLayerKey key) {
  SparkNode node;
  node.type = type;
  node.id = NodeId(letter, index).value;
  node.key = key;
  node.position = {1.5, -2.25, static_cast<double>(index)};
  if (IsSemantic(type)) {
    node.name = std::string(1, letter) + std::to_string(index);
    node.color = Color{1, 2, 3, 4};
    node.label = 5;
  }
  return node;
}

void AddSampleObjects(SparkGraph* graph) {
  SparkNode object = SparkNodeOf(SparkClass::kObject, 'O', 1, {2, 0});
  object.attributes = {{"mesh_connections", 3.0},
                       {"registered", true},
                       {"semantic_feature", 2.0},
                       {"metadata", std::string("{\"a\":1}")},
                       {"is_active", true}};
  object.box = {SparkBox::Type::kAligned,
                {1.0f, 2.0f, 0.5f},
                {1.5f, -2.0f, 1.0f},
                Eigen::Matrix3f::Identity()};
  object.last_update_ns = 1'500'000'000;
  SparkNode khronos = SparkNodeOf(SparkClass::kKhronosObject, 'O', 2, {2, 0});
  khronos.first_observed_ns = {1'000'000'000, 3'000'000'000};
  khronos.last_observed_ns = {2'000'000'000, 4'000'000'000};
  khronos.attributes = {{"trajectory_positions", 2.0},  {"trajectory_timestamps", 2.0},
                        {"dynamic_object_points", 1.0}, {"details", 2.0},
                        {"mesh_vertices", 3.0},         {"mesh_faces", 1.0}};
  graph->nodes.insert(graph->nodes.end(), {object, khronos});
}

void AddSamplePoses(SparkGraph* graph) {
  SparkNode pose = SparkNodeOf(SparkClass::kAgent, 'a', 0, {2, 97});
  pose.stamp_ns = 1'000'000'000;
  pose.orientation = {0.6, 0.0, 0.0, 0.8};
  pose.attributes = {{"external_key", std::string("77")}, {"dbow_ids", 1.0}, {"dbow_values", 1.0}};
  SparkNode later_pose = SparkNodeOf(SparkClass::kAgent, 'a', 1, {2, 97});
  later_pose.stamp_ns = 2'000'000'000;
  graph->nodes.insert(graph->nodes.end(), {pose, later_pose});
}

void AddSamplePlaces(SparkGraph* graph) {
  SparkNode place = SparkNodeOf(SparkClass::kPlace, 'p', 0, {3, 0});
  place.distance = 0.75;
  place.basis_point_count = 4;
  place.is_predicted = true;
  place.attributes = {
      {"voxblox_mesh_connections", 2.0}, {"pcl_mesh_connections", 1.0}, {"mesh_vertex_labels", 1.0},
      {"deformation_connections", 1.0},  {"real_place", true},          {"active_frontier", true},
      {"frontier_scale_y", 0.5},         {"num_frontier_voxels", 12.0}};
  SparkNode place_2d = SparkNodeOf(SparkClass::kPlace2d, 'P', 7, {3, 1});
  place_2d.boundary = {{0, 0, 0.1}, {1, 0, 0.2}, {0, 1, 0.3}};
  place_2d.attributes = {{"pcl_boundary_connections", 2.0}, {"need_cleanup_splitting", true}};
  graph->nodes.insert(graph->nodes.end(), {place, place_2d});
}

void AddSampleRegions(SparkGraph* graph) {
  SparkNode room = SparkNodeOf(SparkClass::kRoom, 'R', 0, {4, 0});
  room.class_probabilities = {{"kitchen", 0.25}, {"office", 0.75}};
  SparkNode ground = SparkNodeOf(SparkClass::kTraversability, 't', 0, {3, 2});
  ground.first_observed_ns = {1'000'000'000};
  ground.last_observed_ns = {2'000'000'000};
  ground.distance = 0.5;
  ground.attributes = {{"min_x", -1.0}, {"max_y", 2.0}, {"states_2", 4.0}};
  graph->nodes.insert(graph->nodes.end(), {room, SparkNodeOf(SparkClass::kSemantic, 'B', 0, {5, 0}),
                                           SparkNodeOf(SparkClass::kNode, 'C', 0, {9, 4}), ground});
}

MeshBlock SampleMesh() {
  MeshBlock mesh;
  mesh.positions_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.colors = {0x010203, 0x040506, 0xFFFFFF};
  mesh.labels = {1, 2, 3};
  mesh.first_seen_ns = {10, 20, 30};
  mesh.last_seen_ns = {11, 21, 31};
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

}  // namespace

SparkGraph SampleSparkGraph() {
  SparkGraph graph;
  graph.layer_names = {{"OBJECTS", {2, 0}}, {"SEGMENTS", {1, 0}}, {"CITY", {9, 4}}};
  graph.label_spaces = {{{2, 0}, {{4, "lamp"}, {5, "chair"}}}, {{4, 0}, {{5, "office"}}}};
  AddSampleObjects(&graph);
  AddSamplePoses(&graph);
  AddSamplePlaces(&graph);
  AddSampleRegions(&graph);
  const auto id = [](char letter, uint64_t index) { return NodeId(letter, index).value; };
  graph.edges = {{id('p', 0), id('a', 0), false, 1.0, ""},
                 {id('a', 1), id('a', 0), false, 1.0, ""},
                 {id('O', 1), id('p', 0), true, 0.5, "{\"b\":[1,2]}"},
                 {id('R', 0), id('p', 0), false, 1.0, ""},
                 {id('B', 0), id('R', 0), false, 1.0, ""},
                 {id('C', 0), id('B', 0), false, 1.0, ""},
                 {id('p', 0), id('P', 7), true, 0.25, ""}};
  graph.mesh = SampleMesh();
  return graph;
}

namespace {

void ExpectSameNode(const SparkNode& actual, const SparkNode& expected) {
  SCOPED_TRACE(ToString(NodeId(expected.id)));
  EXPECT_EQ(actual.id, expected.id);
  EXPECT_EQ(actual.key, expected.key);
  EXPECT_EQ(actual.type, expected.type);
  EXPECT_EQ(actual.stamp_ns, expected.stamp_ns);
  EXPECT_EQ(actual.position, expected.position);
  EXPECT_EQ(actual.last_update_ns, expected.last_update_ns);
  EXPECT_EQ(actual.is_predicted, expected.is_predicted);
  EXPECT_EQ(actual.name, expected.name);
  EXPECT_EQ(actual.color, expected.color);
  EXPECT_EQ(actual.box.type, expected.box.type);
  EXPECT_EQ(actual.box.dimensions, expected.box.dimensions);
  EXPECT_EQ(actual.box.center, expected.box.center);
  EXPECT_EQ(actual.box.rotation, expected.box.rotation);
  EXPECT_EQ(actual.label, expected.label);
  EXPECT_EQ(actual.orientation.coeffs(), expected.orientation.coeffs());
  EXPECT_EQ(actual.distance, expected.distance);
  EXPECT_EQ(actual.basis_point_count, expected.basis_point_count);
  EXPECT_EQ(actual.boundary, expected.boundary);
  EXPECT_EQ(actual.class_probabilities, expected.class_probabilities);
  EXPECT_EQ(actual.first_observed_ns, expected.first_observed_ns);
  EXPECT_EQ(actual.last_observed_ns, expected.last_observed_ns);
  EXPECT_EQ(actual.attributes, expected.attributes);
}

}  // namespace

void ExpectSameGraph(const SparkGraph& actual, const SparkGraph& expected) {
  ASSERT_EQ(actual.nodes.size(), expected.nodes.size());
  for (size_t i = 0; i < actual.nodes.size(); ++i) {
    ExpectSameNode(actual.nodes[i], expected.nodes[i]);
  }
  ASSERT_EQ(actual.edges.size(), expected.edges.size());
  for (size_t i = 0; i < actual.edges.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(actual.edges[i].source, expected.edges[i].source);
    EXPECT_EQ(actual.edges[i].target, expected.edges[i].target);
    EXPECT_EQ(actual.edges[i].weighted, expected.edges[i].weighted);
    EXPECT_EQ(actual.edges[i].weight, expected.edges[i].weight);
    EXPECT_EQ(actual.edges[i].metadata, expected.edges[i].metadata);
  }
  EXPECT_EQ(actual.layer_names, expected.layer_names);
  EXPECT_EQ(actual.label_spaces, expected.label_spaces);
  ASSERT_EQ(actual.mesh.has_value(), expected.mesh.has_value());
  if (!actual.mesh.has_value()) return;
  EXPECT_EQ(actual.mesh->positions_map, expected.mesh->positions_map);
  EXPECT_EQ(actual.mesh->colors, expected.mesh->colors);
  EXPECT_EQ(actual.mesh->labels, expected.mesh->labels);
  EXPECT_EQ(actual.mesh->first_seen_ns, expected.mesh->first_seen_ns);
  EXPECT_EQ(actual.mesh->last_seen_ns, expected.mesh->last_seen_ns);
  EXPECT_EQ(actual.mesh->faces, expected.mesh->faces);
}

}  // namespace dsg
