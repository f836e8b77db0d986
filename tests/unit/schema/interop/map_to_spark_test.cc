// SPDX-License-Identifier: Apache-2.0
// What a Spark-DSG file says comes back out of a map, and what a map says out of a Spark-DSG file.
#include "schema/interop/map_to_spark.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "schema/interop/json_cursor.h"
#include "schema/interop/spark_binary.h"
#include "schema/interop/spark_json.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_to_delta.h"
#include "schema/interop/spark_writer.h"
#include "tests/unit/schema/interop/interop_test_util.h"
#include "tests/unit/schema/interop/spark_binary_writer.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

SparkGraph ReadJson(const std::string& text) {
  auto root = SplitJson(text, "g.json");
  EXPECT_TRUE(root.ok()) << root.status();
  auto graph = ReadSparkJson(*root, "g.json");
  EXPECT_TRUE(graph.ok()) << graph.status();
  return graph.ok() ? *std::move(graph) : SparkGraph();
}

SparkGraph ReadBinary(const std::string& bytes) {
  auto graph = ReadSparkBinary(bytes, "g.sparkdsg");
  EXPECT_TRUE(graph.ok()) << graph.status();
  return graph.ok() ? *std::move(graph) : SparkGraph();
}

MapContents ContentsOf(const GraphDelta& delta) {
  MapContents map;
  map.spec.name = "m";
  map.revision = 3;
  map.layers = DefaultLayers();
  map.layers.insert(map.layers.end(), delta.layers.begin(), delta.layers.end());
  map.nodes = delta.nodes;
  map.edges = delta.edges;
  map.tracks = delta.appends;
  map.mesh = delta.mesh_blocks;
  return map;
}

GraphDelta Import(const SparkGraph& graph) {
  auto imported = SparkToDelta(graph, "g.json", 2.0);
  EXPECT_TRUE(imported.ok()) << imported.status();
  if (!imported.ok()) return {};
  EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
  return imported->delta;
}

SparkExport Export(const MapContents& map) {
  auto exported = MapToSpark(map, {});
  EXPECT_TRUE(exported.ok()) << exported.status();
  return exported.ok() ? *std::move(exported) : SparkExport();
}

// Nodes by id, edges by their ends.
void ExpectSameContent(const SparkGraph& actual, const SparkGraph& expected) {
  std::map<uint64_t, const SparkNode*> nodes;
  for (const SparkNode& node : actual.nodes) nodes[node.id] = &node;
  ASSERT_EQ(actual.nodes.size(), expected.nodes.size());
  for (const SparkNode& node : expected.nodes) {
    SCOPED_TRACE(ToString(NodeId(node.id)));
    ASSERT_TRUE(nodes.contains(node.id));
    EXPECT_EQ(nodes[node.id]->key, node.key);
    EXPECT_EQ(nodes[node.id]->type, node.type);
    EXPECT_EQ(AllFieldsOf(*nodes[node.id]).dump(), AllFieldsOf(node).dump());
    EXPECT_TRUE(nodes[node.id]->own.is_null()) << nodes[node.id]->own.dump();
  }
  std::map<std::pair<uint64_t, uint64_t>, const SparkEdge*> edges;
  for (const SparkEdge& edge : actual.edges) edges[std::minmax(edge.source, edge.target)] = &edge;
  ASSERT_EQ(actual.edges.size(), expected.edges.size());
  for (const SparkEdge& edge : expected.edges) {
    const auto found = edges.find(std::minmax(edge.source, edge.target));
    ASSERT_NE(found, edges.end());
    EXPECT_EQ(found->second->weight, edge.weight);
    EXPECT_EQ(found->second->weighted, edge.weighted);
    EXPECT_EQ(found->second->metadata, edge.metadata);
    EXPECT_TRUE(found->second->own.is_null()) << found->second->own.dump();
  }
}

TEST(SparkWriter, WritesTheJsonThatItsReaderReads) {
  SparkGraph graph = ReadJson(SparkToBytes(SampleSparkGraph(), SparkForm::kJson));
  const SparkGraph again = ReadJson(SparkToBytes(graph, SparkForm::kJson));
  ExpectSameGraph(again, graph);
  ExpectSameContent(again, graph);
}

TEST(SparkWriter, WritesTheBinaryOfAWriterMadeFromTheFormatAlone) {
  const SparkGraph graph = ReadBinary(WriteSparkBinary(SampleSparkGraph()));
  const SparkGraph again = ReadBinary(SparkToBytes(graph, SparkForm::kBinary));
  ExpectSameGraph(again, graph);
  ExpectSameContent(again, graph);
}

TEST(SparkWriter, SaysTheSameInBothForms) {
  const SparkGraph graph = ReadBinary(WriteSparkBinary(SampleSparkGraph()));
  const SparkGraph json = ReadJson(SparkToBytes(graph, SparkForm::kJson));
  ExpectSameContent(json, graph);
  ExpectSameContent(ReadBinary(SparkToBytes(json, SparkForm::kBinary)), graph);
}

TEST(MapToSpark, FindsNothingToAddToWhatCameFromTheFormat) {
  const SparkGraph graph = ReadBinary(WriteSparkBinary(SampleSparkGraph()));
  const GraphDelta first = Import(graph);
  const GraphDelta second =
      Import(ReadJson(SparkToBytes(Export(ContentsOf(first)).graph, SparkForm::kJson)));
  const auto to = NodesToJson(first.nodes, first.layers);
  const auto from = NodesToJson(second.nodes, second.layers);
  ASSERT_EQ(to.size(), from.size());
  for (size_t i = 0; i < to.size(); ++i) EXPECT_EQ(to[i].dump(1), from[i].dump(1));
}

TEST(MapToSpark, GivesBackEveryClassAndListOfASparkFile) {
  const SparkGraph graph = ReadBinary(WriteSparkBinary(SampleSparkGraph()));
  const SparkExport exported = Export(ContentsOf(Import(graph)));
  ExpectSameContent(exported.graph, graph);
  for (const auto& [name, key] : graph.layer_names) {
    EXPECT_EQ(exported.graph.layer_names.at(name), key) << name;
  }
  EXPECT_EQ(exported.graph.metadata, graph.metadata);
  EXPECT_FALSE(exported.graph.own.contains("robots"));
  ASSERT_TRUE(exported.graph.mesh.has_value());
  EXPECT_EQ(exported.graph.mesh->positions_map, graph.mesh->positions_map);
  EXPECT_EQ(exported.graph.mesh->faces, graph.mesh->faces);
  EXPECT_EQ(exported.graph.mesh->labels, graph.mesh->labels);
}

class RecordedRoundTrip : public testing::TestWithParam<const char*> {};

TEST_P(RecordedRoundTrip, IsTheSameContent) {
  const std::string text = ReadDataFile(GetParam());
  if (text.empty()) GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
  const SparkGraph graph = ReadJson(text);
  const SparkExport exported = Export(ContentsOf(Import(graph)));
  ExpectSameContent(exported.graph, graph);
  const SparkGraph json = ReadJson(SparkToBytes(exported.graph, SparkForm::kJson));
  ExpectSameContent(json, graph);
  EXPECT_EQ(json.metadata.empty(), graph.metadata.empty());
}

INSTANTIATE_TEST_SUITE_P(All, RecordedRoundTrip,
                         testing::Values("dsg-spark/apartment_dsg.json",
                                         "dsg-spark/mp3d_x8F5xyUWy9e_0_partial_dsg_600.json",
                                         "dsg-spark/mp3d_x8F5xyUWy9e_0_partial_dsg_1447.json",
                                         "dsg-spark/b45_rooms_places2d_objects.json"));

}  // namespace
}  // namespace dsg
