// SPDX-License-Identifier: Apache-2.0
// Spark-DSG's JSON in the forms of its versions, and what is refused.
#include "schema/interop/spark_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "schema/interop/spark_fields.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

absl::StatusOr<SparkGraph> Read(const std::string& text) {
  auto members = SplitJson(text, "g.json");
  if (!members.ok()) return members.status();
  return ReadSparkJson(*members, "g.json");
}

// A graph of one node: what stands in the node beside its attributes, and these.
std::string OneNode(const std::string& node, const std::string& attributes) {
  return R"({"nodes": [{"id": 5692549928996306945, "layer": 2, )" + node +
         R"("attributes": {"position": [1, 2, 3], )" + attributes + R"(}}], "edges": []})";
}

TEST(SparkJson, TakesTheAgentsTimeFromTheNodeBefore110) {
  const auto graph = Read(
      R"({"nodes": [{"id": 6989586621679009793, "layer": 2, "prefix": 97, "timestamp": 3647910000,
          "attributes": {"type": "AgentNodeAttributes", "position": [1, 2, 3], "dbow_ids": null,
          "external_key": 6989586621679009793}}], "edges": [], "layer_ids": [2, 3]})");
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->nodes[0].stamp_ns, 3647910000);
  EXPECT_EQ(graph->nodes[0].key, (SparkLayerKey{2, 97}));
  EXPECT_EQ(graph->version, (SparkVersion{1, 0, 0}));
}

TEST(SparkJson, TakesTheAgentsTimeFromItsAttributesSince110) {
  const auto graph = Read(
      R"({"SPARK_DSG_header": {"project_name": "main",
          "version": {"major": 1, "minor": 1, "patch": 3}},
          "layer_names": {"AGENTS": {"layer": 2, "partition": 97}, "OLD": 7},
          "nodes": [{"id": 6989586621679009793, "layer": 2, "partition": 97, "attributes": {
          "type": "AgentNodeAttributes", "position": [1, 2, 3], "timestamp": 42}}], "edges": []})");
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->nodes[0].stamp_ns, 42);
  EXPECT_EQ(graph->version, kSparkVersionNewest);
  EXPECT_EQ(graph->layer_names.at("AGENTS"), (SparkLayerKey{2, 97}));
  EXPECT_EQ(graph->layer_names.at("OLD"), (SparkLayerKey{7, 0}));
}

// All defaults of all classes in a node, so that most are of other classes than its own.
std::string TwoNodesOfDefaults(const std::string& type, const std::string& blank) {
  std::map<std::string, std::string> fields;
  for (int i = 0; i <= static_cast<int>(SparkClass::kTraversability); ++i) {
    for (const auto& [name, text] : UsualTexts(static_cast<SparkClass>(i))) fields[name] = text;
  }
  fields["name"] = "\"extinguisher\"";
  fields["position"] = "[1.0,2.0,0.5]";
  fields["bounding_box"] = R"({"type":"AABB","dimensions":[1.0,1.0,1.0],"world_P_center":)"
                           R"([1.0,2.0,0.5],"world_R_center":{"w":1.0,"x":0.0,"y":0.0,"z":0.0}})";
  if (!type.empty()) fields["type"] = "\"" + type + "\"";
  std::string attributes;
  for (const auto& [name, text] : fields) {
    attributes += (attributes.empty() ? "\"" : ",\"") + name + "\":" + text + blank;
  }
  const std::string node = R"("layer":2,"partition":0,"attributes":{)" + attributes + "}}";
  return R"({"nodes":[{"id":5692549928996306945,)" + node + R"(,{"id":5692549928996306946,)" +
         node + R"(],"edges":[]})";
}

TEST(SparkJson, ReadsTheSameWhateverBlanksStandBehindDefaults) {
  for (const char* type :
       {"NodeAttributes", "SemanticNodeAttributes", "ObjectNodeAttributes", "RoomNodeAttributes",
        "PlaceNodeAttributes", "Place2dNodeAttributes", "AgentNodeAttributes",
        "TraversabilityNodeAttributes", "MyNodeAttributes", ""}) {
    const auto dense = Read(TwoNodesOfDefaults(type, ""));
    const auto spaced = Read(TwoNodesOfDefaults(type, " "));
    ASSERT_TRUE(dense.ok() && spaced.ok()) << type << dense.status() << spaced.status();
    ExpectSameGraph(*dense, *spaced);
    for (const size_t i : {0, 1}) {
      EXPECT_EQ(SparseFieldsOf(dense->nodes[i]), SparseFieldsOf(spaced->nodes[i])) << type << i;
    }
    EXPECT_EQ(dense->skips.all().size(), spaced->skips.all().size()) << type;
  }
}

TEST(SparkJson, KeepsTheSignOfZero) {
  const auto graph = Read(OneNode("", R"("type": "NodeAttributes", "other": -0)"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_TRUE(std::signbit(SparseFieldsOf(graph->nodes[0]).at("other").get<double>()));
}

TEST(SparkJson, ReadsColorsAndBoxesOfBothForms) {
  const auto old = Read(OneNode("", R"("type": "ObjectNodeAttributes", "color": [9, 8, 7],
      "bounding_box": {"type": "OBB", "min": [-1, -2, -3], "max": [1, 2, 3],
      "world_P_center": [4, 5, 6], "world_R_center": {"w": 0, "x": 0, "y": 0, "z": 2}})"));
  ASSERT_TRUE(old.ok()) << old.status();
  const auto present = Read(OneNode("\"partition\": 0, ", R"("type": "ObjectNodeAttributes",
      "color": {"r": 9, "g": 8, "b": 7, "a": 255}, "semantic_feature": {"rows": 0, "cols": 0,
      "data": null}, "bounding_box": {"type": 2, "dimensions": [2, 4, 6],
      "world_P_center": [4, 5, 6], "world_R_center": {"w": 0, "x": 0, "y": 0, "z": 1}})"));
  ASSERT_TRUE(present.ok()) << present.status();
  ExpectSameGraph(*old, *present);
  EXPECT_EQ(old->nodes[0].color, (Color{9, 8, 7, 255}));
  EXPECT_EQ(old->nodes[0].box.type, SparkBox::Type::kOriented);
  EXPECT_EQ(old->nodes[0].box.dimensions, Eigen::Vector3f(2, 4, 6));
  EXPECT_FLOAT_EQ(old->nodes[0].box.rotation(0, 0), -1.0f);
}

TEST(SparkJson, LeavesTheLabelOutWhenThereIsNone) {
  const auto graph =
      Read(OneNode("", R"("type": "ObjectNodeAttributes", "semantic_label": 4294967295)"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_FALSE(graph->nodes[0].label.has_value());
}

TEST(SparkJson, ReadsTheMeshOfBothForms) {
  const auto old = Read(R"({"nodes": [], "edges": [], "mesh": {
      "vertices": [{"x": 0, "y": 0, "z": 0, "r": 1, "g": 2, "b": 3},
                   {"x": 1, "y": 0, "z": 0, "r": 1, "g": 2, "b": 3},
                   {"x": 0, "y": 1, "z": 0, "r": 1, "g": 2, "b": 3}], "faces": [[0, 1, 2]]}})");
  ASSERT_TRUE(old.ok()) << old.status();
  const std::string mesh = R"({"has_colors": true, "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
      "colors": [[1, 2, 3], {"r": 1, "g": 2, "b": 3, "a": 255}, [1, 2, 3, 255]],
      "faces": [[0, 1, 2]]})";
  const auto present = Read(R"({"nodes": [], "edges": [], "mesh": )" + mesh + "}");
  ASSERT_TRUE(present.ok()) << present.status();
  ExpectSameGraph(*old, *present);
  const auto file = Read(mesh);
  ASSERT_TRUE(file.ok()) << file.status();
  ExpectSameGraph(*file, *present);
  EXPECT_EQ(file->mesh->colors, std::vector<uint32_t>(3, 0x010203));
}

TEST(SparkJson, ReadsAFrontierAsAPlace) {
  const auto graph = Read(OneNode("", R"("type": "FrontierNodeAttributes", "distance": 0.5)"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->nodes[0].type, SparkClass::kPlace);
  EXPECT_EQ(graph->nodes[0].distance, 0.5);
}

TEST(SparkJson, IgnoresTheUninitialisedEllipseFields) {
  const auto graph = Read(OneNode("", R"("type": "Place2dNodeAttributes",
      "boundary": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "ellipse_centroid": [null, 1e300, "x"])"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->nodes[0].boundary.size(), 3u);
}

TEST(SparkJson, KeepsMetadataAndNotesLabelSpacesThatItDoesNotUnderstand) {
  const auto graph = Read(R"({"nodes": [], "edges": [], "metadata": {"mission": 7,
      "labelspaces": {"_l3p1": [[2, "floor"]], "odd": [[1, "x"]], "_l2p0": [["x", 1]]}}})");
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->label_spaces.size(), 1u);
  EXPECT_EQ(graph->label_spaces.at({3, 1})[0].name, "floor");
  EXPECT_EQ(graph->notes.size(), 2u);
  EXPECT_EQ(graph->metadata["mission"], 7);
}

struct BadField {
  const char* attributes;
  const char* named;
};

TEST(SparkJson, LeavesOutAndNamesTheFieldThatIsWrong) {
  const BadField cases[] = {
      {R"("type": "WallNodeAttributes")", "nodes[0].attributes.type: \"WallNodeAttributes\""},
      {R"("type": 7)", "nodes[0].attributes.type: is number"},
      {R"("type": "ObjectNodeAttributes", "name": 3)", "nodes[0].attributes.name"},
      {R"("type": "ObjectNodeAttributes", "color": [1, 2])", "nodes[0].attributes.color"},
      {R"("type": "ObjectNodeAttributes", "color": [1, 2, 256])", "nodes[0].attributes.color"},
      {R"("type": "ObjectNodeAttributes", "semantic_label": -1)", "attributes.semantic_label"},
      {R"("type": "ObjectNodeAttributes", "bounding_box": {"type": "BALL"})",
       "attributes.bounding_box.type: \"BALL\""},
      {R"("type": "ObjectNodeAttributes", "bounding_box": {"type": "AABB"})",
       "attributes.bounding_box.min: is missing"},
      {R"("type": "ObjectNodeAttributes", "mesh_connections": 3)", "attributes.mesh_connections"},
      {R"("type": "ObjectNodeAttributes", "world_R_object": {"w": 1})",
       "attributes.world_R_object.x: is missing"},
      {R"("type": "PlaceNodeAttributes", "distance": "far")", "attributes.distance: is string"},
      {R"("type": "RoomNodeAttributes", "semantic_class_probabilities": [1])",
       "attributes.semantic_class_probabilities"},
      {R"("type": "AgentNodeAttributes", "timestamp": 9223372036854775808)",
       "attributes.timestamp: is a number out of range"},
  };
  for (const BadField& bad : cases) {
    SCOPED_TRACE(bad.attributes);
    const auto graph = Read(OneNode("", bad.attributes));
    ASSERT_TRUE(graph.ok()) << graph.status();
    ExpectSkipped(graph->skips.all(), bad.named);
    ASSERT_EQ(graph->nodes.size(), 1u);
    EXPECT_EQ(graph->nodes[0].position, Eigen::Vector3d(1, 2, 3));
  }
}

TEST(SparkJson, ReadsTheOtherFieldsOfANodeWithTwoWrongOnes) {
  const auto graph = Read(OneNode("", R"("type": "PlaceNodeAttributes", "distance": "far",
      "name": "here", "color": {"r": 1}, "num_basis_points": 4)"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  ASSERT_EQ(graph->nodes.size(), 1u);
  EXPECT_EQ(graph->nodes[0].name, "here");
  EXPECT_EQ(graph->nodes[0].basis_point_count, 4u);
  EXPECT_FALSE(graph->nodes[0].color.has_value());
  EXPECT_EQ(graph->nodes[0].distance, 0.0);
  EXPECT_EQ(AllFieldsOf(graph->nodes[0])["distance"], 0.0);
  ASSERT_EQ(graph->skips.all().size(), 1u);
  EXPECT_EQ(graph->skips.all()[0].count, 2);
}

TEST(SparkJson, ReadsAClassThatItDoesNotKnowByTheFieldsItKnows) {
  const auto graph = Read(OneNode("", R"("type": "MyObjectAttributes", "semantic_label": 7,
      "name": "mug", "handle_count": 1)"));
  ASSERT_TRUE(graph.ok()) << graph.status();
  ASSERT_EQ(graph->nodes.size(), 1u);
  EXPECT_EQ(graph->nodes[0].type, SparkClass::kSemantic);
  EXPECT_EQ(graph->nodes[0].name, "mug");
  EXPECT_EQ(AllFieldsOf(graph->nodes[0])["handle_count"], 1);
}

TEST(SparkJson, CountsNodesAndEdgesThatAreNone) {
  const auto graph = Read(R"({"nodes": [3, {"id": -1, "layer": 2}, {"id": 5692549928996306945,
      "layer": 2, "attributes": {"type": "ObjectNodeAttributes", "position": [1, 2]}}],
      "edges": [7, {"source": 1, "target": 2, "info": {"weight": "heavy"}}, {"source": 1,
      "target": 2, "info": {}}]})");
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_TRUE(graph->nodes.empty());
  EXPECT_EQ(graph->edges.size(), 1u);
  const auto skipped = graph->skips.all();
  ASSERT_EQ(skipped.size(), 2u);
  EXPECT_EQ(skipped[0].count, 3);
  EXPECT_EQ(skipped[1].count, 2);
  for (const char* part : {"nodes[0]: is a number", "nodes[1].id", "nodes[2].attributes: ",
                           "edges[0]: is a number", "edges[1].info.weight: is string"}) {
    ExpectSkipped(skipped, part);
  }
}

TEST(SparkJson, RefusesAFileWithoutNodesOrEdges) {
  ExpectMalformed(Read(R"({"edges": []})").status(), "nodes: is missing");
  ExpectMalformed(Read(R"({"nodes": []})").status(), "edges: is missing");
  ExpectMalformed(Read("[1]").status(), "the file: is array; expected an object");
  ExpectMalformed(Read(R"({"nodes": {}, "edges": []})").status(), "nodes: is object");
}

}  // namespace
}  // namespace dsg
