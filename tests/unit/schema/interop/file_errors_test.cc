// SPDX-License-Identifier: Apache-2.0
// Files with edges that lead nowhere and the like: read but for these, or refused if asked to.
#include "schema/interop/file_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/interop/spark_to_delta.h"
#include "schema/interop/spark_writer.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kNowhere = uint64_t{'p'} << 56 | 99'999;

// The sample, with `count` edges more that lead nowhere.
SparkGraph WithDanglingEdges(uint64_t count) {
  SparkGraph graph = SampleSparkGraph();
  for (uint64_t i = 0; i < count; ++i) {
    graph.edges.push_back({NodeId('R', 0).value, kNowhere + i, false, 1.0, ""});
  }
  return graph;
}

class SkipsInForm : public testing::TestWithParam<SparkForm> {};

TEST_P(SkipsInForm, ReadAFileButForTheEdgesThatLeadNowhere) {
  const std::string bytes = SparkToBytes(WithDanglingEdges(6), GetParam());
  const auto read = ReadSceneGraph(bytes, "g", 2.0);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(CheckImport(*read).ok()) << CheckImport(*read);
  EXPECT_EQ(read->node_count, 10);
  EXPECT_EQ(read->edge_count, 7);
  EXPECT_EQ(read->delta.edges.size(), 7u);
  ASSERT_EQ(read->skipped.size(), 1u);
  EXPECT_EQ(read->skipped[0].count, 6);
  EXPECT_EQ(ToString(read->skipped[0]),
            "skipped 6 edges to nodes that are not there: "
            "edge R0 to p99999: node 8070450532248028831 (p99999) is not in the file; "
            "edge R0 to p100000: node 8070450532248028832 (p100000) is not in the file; "
            "edge R0 to p100001: node 8070450532248028833 (p100001) is not in the file; "
            "and 3 more");
}

TEST_P(SkipsInForm, RefuseTheFileWithTheSameWordsIfStrict) {
  const std::string bytes = SparkToBytes(WithDanglingEdges(6), GetParam());
  const auto lenient = ReadSceneGraph(bytes, "g", 2.0);
  ASSERT_TRUE(lenient.ok()) << lenient.status();
  const auto strict = ReadSceneGraph(bytes, "g", 2.0, {.is_strict = true});
  ExpectMalformed(strict.status(), absl::StrCat("g: ", ToString(lenient->skipped.at(0)),
                                                "; refused, because the read is strict"));
  const std::string sound = SparkToBytes(SampleSparkGraph(), GetParam());
  EXPECT_TRUE(ReadSceneGraph(sound, "g", 2.0, {.is_strict = true}).ok());
}

INSTANTIATE_TEST_SUITE_P(Both, SkipsInForm, testing::Values(SparkForm::kJson, SparkForm::kBinary),
                         [](const auto& form) {
                           return form.param == SparkForm::kJson ? "Json" : "Binary";
                         });

TEST(Skips, TakeTheEdgesOfASkippedNodeWithIt) {
  SparkGraph graph = SampleSparkGraph();
  graph.nodes[4].position.x() = 1e9;
  const auto read = ReadSceneGraph(SparkToBytes(graph, SparkForm::kJson), "g", 2.0);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(CheckImport(*read).ok()) << CheckImport(*read);
  EXPECT_EQ(read->node_count, 9);
  EXPECT_EQ(read->edge_count, 3);
  ExpectSkipped(read->skipped, "skipped 1 nodes that a map cannot hold: node p0: position");
  ExpectSkipped(read->skipped, "skipped 4 edges to nodes that are not there");
}

TEST(Skips, RefuseAFileOfWhichNothingIsLeft) {
  const auto read = ReadSceneGraph(
      R"({"nodes": [{"id": 1, "layer": 2, "attributes": {"type": "ObjectNodeAttributes",
          "position": [0, 0, 0]}}], "edges": []})",
      "g", 2.0);
  ExpectMalformed(read.status(), "node id 1: has no letter");
  ExpectMalformed(read.status(), "nothing of the file is left");
}

TEST(Skips, LeaveTheMeshButForUnsoundVertices) {
  SparkGraph graph = SampleSparkGraph();
  graph.mesh->positions_map.insert(graph.mesh->positions_map.begin(), {NAN, 0, 0});
  for (auto* channel : {&graph.mesh->colors, &graph.mesh->labels}) {
    channel->insert(channel->begin(), 7);
  }
  for (auto* channel : {&graph.mesh->first_seen_ns, &graph.mesh->last_seen_ns}) {
    channel->insert(channel->begin(), 7);
  }
  graph.mesh->faces = {{1, 2, 3}, {0, 1, 2}, {1, 2, 4}};
  const auto read = SparkToDelta(graph, "g", 2.0);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(CheckImport(*read).ok()) << CheckImport(*read);
  EXPECT_EQ(read->mesh_vertex_count, 3);
  EXPECT_EQ(read->mesh_face_count, 1);
  ASSERT_EQ(read->delta.mesh_blocks.size(), 1u);
  EXPECT_EQ(read->delta.mesh_blocks[0].colors, SampleSparkGraph().mesh->colors);
  EXPECT_EQ(read->delta.mesh_blocks[0].faces, SampleSparkGraph().mesh->faces);
  ExpectSkipped(read->skipped, "mesh vertex 0: is not finite");
  ExpectSkipped(read->skipped, "mesh face 2: has vertex 4; there are 4");
}

// What the file itself says of edges that lead nowhere.
int64_t CountDangling(const Json& root) {
  std::set<uint64_t> ids;
  for (const Json& node : root["nodes"]) ids.insert(node["id"].get<uint64_t>());
  int64_t count = 0;
  for (const Json& edge : root["edges"]) {
    const bool is_sound = ids.contains(edge["source"].get<uint64_t>()) &&
                          ids.contains(edge["target"].get<uint64_t>());
    count += is_sound ? 0 : 1;
  }
  return count;
}

// Recorded files of the field in DSG_DATA/dsg-spark, whatever they are called.
TEST(Skips, ReadTheRecordedFilesWithEdgesThatLeadNowhere) {
  const char* folder = std::getenv("DSG_DATA");
  const std::filesystem::path root = folder != nullptr ? folder : DSG_SOURCE_DIR "/../shared/data";
  std::error_code error;
  int64_t found_count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(root / "dsg-spark", error)) {
    if (entry.path().extension() != ".json") continue;
    const std::string name = entry.path().filename().string();
    const std::string bytes = ReadDataFile("dsg-spark/" + name);
    const Json json = Json::parse(bytes, nullptr, false);
    if (!json.is_object() || !json.contains("edges") || !json["nodes"].is_array()) continue;
    const int64_t dangling_count = CountDangling(json);
    if (dangling_count == 0) continue;
    SCOPED_TRACE(name);
    ++found_count;
    const auto read = ReadSceneGraph(bytes, name, 2.0);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_TRUE(CheckImport(*read).ok()) << CheckImport(*read);
    EXPECT_EQ(read->edge_count, static_cast<int64_t>(json["edges"].size()) - dangling_count);
    ExpectSkipped(read->skipped, absl::StrCat("skipped ", dangling_count, " edges to nodes"));
    EXPECT_FALSE(ReadSceneGraph(bytes, name, 2.0, {.is_strict = true}).ok());
  }
  if (found_count == 0) {
    GTEST_SKIP() << "no recorded scene graph has edges that lead nowhere; put one into "
                 << (root / "dsg-spark") << " or set DSG_DATA";
  }
}

}  // namespace
}  // namespace dsg
