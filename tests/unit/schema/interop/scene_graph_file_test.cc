// SPDX-License-Identifier: Apache-2.0
// How files are told apart, and the two small JSON forms.
#include "schema/interop/scene_graph_file.h"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "tests/unit/schema/interop/interop_test_util.h"
#include "tests/unit/schema/interop/spark_binary_writer.h"

namespace dsg {
namespace {

constexpr char kKimera[] = R"({"nodes": [
    {"index": 0, "type": "building", "node_id": 1, "semantic_label": "building",
     "centroid": [1, 2, 3], "size": null},
    {"index": 1, "type": "room", "node_id": 1, "semantic_label": "room", "centroid": [1, 2, 3]},
    {"index": 2, "type": "place", "node_id": 1, "semantic_label": "place", "centroid": [1, 2, 3]},
    {"index": 3, "type": "place", "node_id": 9, "semantic_label": "place", "centroid": [5, 2, 3]},
    {"index": 4, "type": "object", "node_id": 0, "semantic_label": 5, "centroid": [1, 2, 3],
     "size": [2, 4, 6]}],
  "edges": [
    {"start": 1, "end": 0, "rel": "At Location", "weight": 1.0},
    {"start": 2, "end": 1, "rel": "At Location", "weight": 1.0},
    {"start": 4, "end": 2, "rel": "At Location", "weight": 1.0},
    {"start": 2, "end": 3, "rel": "Near", "weight": 0.5},
    {"start": 3, "end": 2, "rel": "Near", "weight": 0.5},
    {"start": 4, "end": 3, "rel": "seen from", "weight": 1.0}]})";

constexpr char kRegions[] = R"json({
    "regions": {"R(1)": {"semantic_label": "road", "center": "(5.938, -0.921)",
                         "objects": ["O(2)"]}},
    "objects": {"O(2)": {"semantic_label": "tree", "center": "(-0.79, 6.112)",
                         "parent_region": "R(1)"},
                "O(3)": {"semantic_label": "tree", "center": "(1, 2)",
                         "parent_region": "none"}}})json";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(SceneGraphFile, TellsSceneGraphsFromOtherFiles) {
  EXPECT_TRUE(LooksLikeSceneGraph(kKimera));
  EXPECT_TRUE(LooksLikeSceneGraph(kRegions));
  EXPECT_TRUE(LooksLikeSceneGraph(WriteSparkBinary(SampleSparkGraph())));
  EXPECT_TRUE(LooksLikeSceneGraph(WriteSparkMeshFile(*SampleSparkGraph().mesh)));
  EXPECT_TRUE(LooksLikeSceneGraph("\n {\"directed\": false"));
  for (const char* other : {"", "   ", "1 2 3.5 4\n", "#timestamp,x,y\n", "{\"config\": 1}", "[1]",
                            "ply\nformat ascii 1.0"}) {
    EXPECT_FALSE(LooksLikeSceneGraph(other)) << other;
  }
}

TEST(SceneGraphFile, ReadsTheBinaryFormAsOneDelta) {
  const auto imported = ReadSceneGraph(WriteSparkBinary(SampleSparkGraph()), "g.sparkdsg", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->format, "spark-dsg");
  EXPECT_EQ(imported->node_count, 10);
  EXPECT_EQ(imported->delta.appends.size(), 1u);
  EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
}

TEST(SceneGraphFile, ReadsAMeshFileAsBlocks) {
  const auto imported =
      ReadSceneGraph(WriteSparkMeshFile(*SampleSparkGraph().mesh), "m.sparkdsg", 0.5);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->mesh_vertex_count, 3);
  EXPECT_EQ(imported->delta.mesh_blocks.size(), 3u);
  EXPECT_TRUE(imported->delta.nodes.empty());
}

TEST(SceneGraphFile, RefusesEmptyFilesAndBlockSizesOutOfRange) {
  ExpectMalformed(ReadSceneGraph("", "g.json", 2.0).status(), "g.json: the file: is empty");
  ExpectMalformed(ReadSceneGraph(" \n\t", "g.json", 2.0).status(), "is empty");
  EXPECT_EQ(ReasonOf(ReadSceneGraph(kKimera, "g.json", 0.0).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(ReadSceneGraph(kKimera, "g.json", 1e9).status()), Reason::kFieldInvalid);
}

TEST(SceneGraphFile, RefusesTextCutAtAnyByte) {
  const std::string_view text = kKimera;
  for (size_t size = 0; size < text.size(); ++size) {
    ASSERT_FALSE(ReadSceneGraph(text.substr(0, size), "k.json", 2.0).ok()) << size;
  }
}

TEST(KimeraJson, MapsTypesRelationsAndSizes) {
  const auto imported = ReadSceneGraph(kKimera, "k.json", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
  EXPECT_EQ(imported->format, "kimera-json");
  const Node& object = NodeNamed(*imported, "O4");
  EXPECT_EQ(object.class_id, 5);
  EXPECT_EQ(object.object->size, Eigen::Vector3d(2, 4, 6));
  EXPECT_EQ(object.BoxMap().max(), Eigen::Vector3d(2, 4, 6));
  EXPECT_EQ(std::get<double>(NodeNamed(*imported, "p3").attributes.at("node_id")), 9.0);
  EXPECT_TRUE(NodeNamed(*imported, "B0").BoxMap().contains(object.BoxMap()));
  std::vector<std::string> edges;
  for (const Edge& edge : imported->delta.edges) {
    edges.push_back(ToString(edge.source) + " " + edge.relation + " " + ToString(edge.target));
  }
  const std::vector<std::string> expected = {"B0 CONTAINS R1",    "R1 CONTAINS p2",
                                             "p2 CONTAINS O4",    "p2 TRAVERSABLE p3",
                                             "p3 TRAVERSABLE p2", "O4 seen from p3"};
  EXPECT_EQ(edges, expected);
}

TEST(KimeraJson, NamesTheFieldThatIsWrong) {
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"\"type\": \"room\"", "\"type\": \"door\"", "nodes[1].type: \"door\""},
      {"\"index\": 3", "\"index\": 2", "nodes[3].index: 2 appears twice"},
      {"[5, 2, 3]", "[5, 2, 3e6]", "nodes[3].centroid"},
      {"[5, 2, 3]", "[5, null, 3]", "nodes[3].centroid"},
      {"[2, 4, 6]", "[2, 4, -6]", "nodes[4].size"},
      {"\"start\": 2, \"end\": 3", "\"start\": 2, \"end\": 8", "edges[3].end: node 8"},
      {"\"start\": 2, \"end\": 3", "\"start\": 3, \"end\": 3", "edges[3].end: is also the start"},
      {"\"start\": 2, \"end\": 3", "\"start\": 3, \"end\": 2", "edges[4].start: repeats"},
      {"\"rel\": \"Near\"", "\"rel\": \"\"", "edges[3].rel"},
  };
  for (const auto& [from, to, named] : cases) {
    SCOPED_TRACE(named);
    const std::string text = Replaced(kKimera, from, to);
    const ReadOptions strict = {.is_strict = true};
    ExpectMalformed(ReadSceneGraph(text, "k.json", 2.0, strict).status(), named);
    const auto lenient = ReadSceneGraph(text, "k.json", 2.0);
    ASSERT_TRUE(lenient.ok()) << lenient.status();
    EXPECT_TRUE(CheckImport(*lenient).ok()) << CheckImport(*lenient);
    ExpectSkipped(lenient->skipped, named);
  }
}

TEST(RegionJson, MapsRegionsToRoomsThatContainTheirObjects) {
  const auto imported = ReadSceneGraph(kRegions, "r.json", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
  EXPECT_EQ(imported->format, "region-json");
  EXPECT_EQ(NodeNamed(*imported, "R1").class_name, "road");
  EXPECT_EQ(NodeNamed(*imported, "O2").map_T_node.position, Eigen::Vector3d(-0.79, 6.112, 0));
  ASSERT_EQ(imported->delta.edges.size(), 1u);
  EXPECT_EQ(imported->delta.edges[0].key(),
            (EdgeKey{NodeId('R', 1), relations::kContains, NodeId('O', 2)}));
}

TEST(RegionJson, NamesTheFieldThatIsWrong) {
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"\"R(1)\":", "\"R1\":", "regions.R1: is not named R(n)"},
      {"(1, 2)", "(1, nan)", "objects.O(3).center"},
      {"(1, 2)", "(1)", "objects.O(3).center"},
  };
  for (const auto& [from, to, named] : cases) {
    SCOPED_TRACE(named);
    ExpectMalformed(ReadSceneGraph(Replaced(kRegions, from, to), "r.json", 2.0).status(), named);
  }
}

TEST(RegionJson, SkipsAParentThatIsNotThere) {
  const std::string text =
      Replaced(kRegions, "\"parent_region\": \"R(1)\"", "\"parent_region\": \"R(8)\"");
  const auto lenient = ReadSceneGraph(text, "r.json", 2.0);
  ASSERT_TRUE(lenient.ok()) << lenient.status();
  EXPECT_TRUE(lenient->delta.edges.empty());
  ExpectSkipped(lenient->skipped, "objects.O(2).parent_region: is no region");
  ExpectMalformed(ReadSceneGraph(text, "r.json", 2.0, {.is_strict = true}).status(),
                  "objects.O(2).parent_region: is no region");
}

TEST(SceneGraphFile, SurvivesRandomDamageOfText) {
  constexpr uint64_t kSeed = 20200718;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  const std::string sources[] = {
      kKimera, kRegions,
      R"({"nodes": [{"id": 5692549928996306945, "layer": 2, "attributes": {"position": [1, 2, 3],
          "type": "ObjectNodeAttributes", "color": [9, 8, 7], "bounding_box": {"type": "AABB",
          "min": [0, 1, 2], "max": [2, 3, 4], "world_P_center": [1, 2, 3]}}},
          {"id": 6989586621679009793, "layer": 2, "timestamp": 7, "attributes": {
          "position": [1, 2, 3], "type": "AgentNodeAttributes"}}],
          "edges": [{"source": 5692549928996306945, "target": 6989586621679009793,
          "info": {"weight": 1.5}}], "mesh": {"points": [[0, 0, 0]], "faces": [[0, 0, 0]]}})"};
  constexpr std::string_view kLetters = "{}[]\",:0123456789-.eEnulltrfasx\\ \xff";
  for (int trial = 0; trial < 20000; ++trial) {
    std::string text = sources[random() % std::size(sources)];
    const uint64_t change_count = random() % 3;
    for (uint64_t i = 0; i <= change_count; ++i) {
      text[random() % text.size()] = kLetters[random() % kLetters.size()];
    }
    const auto read = ReadSceneGraph(text, "g.json", 2.0);
    if (read.ok()) {
      EXPECT_TRUE(CheckImport(*read).ok()) << text << "\n" << CheckImport(*read);
    } else {
      EXPECT_EQ(ReasonOf(read.status()), Reason::kFileMalformed) << read.status();
    }
  }
}

}  // namespace
}  // namespace dsg
