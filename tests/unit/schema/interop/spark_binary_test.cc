// SPDX-License-Identifier: Apache-2.0
// Spark-DSG's binary form against an independent writer, and against damage of every kind.
#include "schema/interop/spark_binary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <random>

#include "schema/interop/json_cursor.h"
#include "schema/interop/spark_json.h"
#include "tests/unit/schema/interop/interop_test_util.h"
#include "tests/unit/schema/interop/spark_binary_writer.h"

namespace dsg {
namespace {

TEST(SparkBinary, ReadsBackEveryFieldOfEveryClass) {
  const SparkGraph graph = SampleSparkGraph();
  const auto read = ReadSparkBinary(WriteSparkBinary(graph), "g.sparkdsg");
  ASSERT_TRUE(read.ok()) << read.status();
  ExpectSameGraph(*read, graph);
  EXPECT_EQ(read->version, kSparkVersionNewest);
}

TEST(SparkBinary, ReadsEveryRecordedGraphWrittenInBinaryAsItsJson) {
  for (const char* name :
       {"apartment_dsg.json", "b45_rooms_places2d_objects.json",
        "mp3d_x8F5xyUWy9e_0_partial_dsg_600.json", "mp3d_x8F5xyUWy9e_0_partial_dsg_1447.json"}) {
    const std::string bytes = ReadDataFile(std::string("dsg-spark/") + name);
    if (bytes.empty()) GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
    SCOPED_TRACE(name);
    const auto json = SplitJson(bytes, name);
    ASSERT_TRUE(json.ok()) << json.status();
    const auto graph = ReadSparkJson(*json, name);
    ASSERT_TRUE(graph.ok()) << graph.status();
    const auto read = ReadSparkBinary(WriteSparkBinary(*graph), name);
    ASSERT_TRUE(read.ok()) << read.status();
    ExpectSameGraph(*read, *graph);
  }
}

// What a version cannot hold, taken out of a graph.
SparkGraph AsWrittenBy(SparkVersion version, SparkGraph graph) {
  std::erase_if(graph.nodes, [](const SparkNode& node) {
    return node.type == SparkClass::kKhronosObject || node.type == SparkClass::kTraversability;
  });
  if (version < SparkVersion{1, 1, 1}) graph.layer_names.clear();
  if (version < SparkVersion{1, 0, 6}) graph.label_spaces.clear();
  for (SparkNode& node : graph.nodes) {
    if (version < SparkVersion{1, 0, 6}) node.attributes.erase("metadata");
    if (version < SparkVersion{1, 1, 0} && !node.stamp_ns.has_value()) node.key.partition = 0;
    if (version < SparkVersion{1, 0, 3} && node.color.has_value()) (*node.color)[3] = 255;
  }
  for (SparkEdge& edge : graph.edges) {
    if (version < SparkVersion{1, 0, 6}) edge.metadata.clear();
  }
  // Before 1.1.0 the nodes with a time follow all others.
  if (version < SparkVersion{1, 1, 0}) {
    std::stable_partition(graph.nodes.begin(), graph.nodes.end(),
                          [](const SparkNode& node) { return !node.stamp_ns.has_value(); });
  }
  return graph;
}

TEST(SparkBinary, ReadsTheFormOfEveryVersion) {
  for (const SparkVersion version :
       {SparkVersion{1, 0, 2}, SparkVersion{1, 0, 3}, SparkVersion{1, 0, 4}, SparkVersion{1, 0, 5},
        SparkVersion{1, 0, 6}, SparkVersion{1, 1, 0}, SparkVersion{1, 1, 1}, SparkVersion{1, 1, 2},
        SparkVersion{1, 1, 3}}) {
    SCOPED_TRACE(ToString(version));
    const SparkGraph graph = AsWrittenBy(version, SampleSparkGraph());
    const auto read = ReadSparkBinary(WriteSparkBinary(graph, version), "g.sparkdsg");
    ASSERT_TRUE(read.ok()) << read.status();
    ExpectSameGraph(*read, graph);
  }
}

TEST(SparkBinary, ReadsAMeshFile) {
  const SparkGraph graph = SampleSparkGraph();
  const auto read = ReadSparkBinary(WriteSparkMeshFile(*graph.mesh), "m.sparkdsg");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_TRUE(read->mesh.has_value());
  EXPECT_EQ(read->mesh->positions_map, graph.mesh->positions_map);
  EXPECT_EQ(read->mesh->faces, graph.mesh->faces);
  EXPECT_TRUE(read->nodes.empty());
}

TEST(SparkBinary, RefusesVersionsWhoseFieldsAreNotKnownSayingWhatToDo) {
  const SparkGraph graph = SampleSparkGraph();
  for (const SparkVersion version : {SparkVersion{1, 0, 1}, SparkVersion{1, 1, 4}}) {
    const auto read = ReadSparkBinary(WriteSparkBinary(graph, version), "g.sparkdsg");
    ExpectMalformed(read.status(), "Save the graph as JSON");
  }
  // Before there was a header a file began with an array of layer ids.
  const std::string headerless("\xdd\x01\0\0\0\xd3\x02\0\0\0\0\0\0\0\xd3\x01\0\0\0\0\0\0\0", 23);
  ExpectMalformed(ReadSparkBinary(headerless, "g.sparkdsg").status(), "save it as JSON");
}

TEST(SparkBinary, RefusesAFileCutAtAnyByteOrGoingOn) {
  const std::string bytes = WriteSparkBinary(SampleSparkGraph());
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto read = ReadSparkBinary(std::string_view(bytes).substr(0, size), "g.sparkdsg");
    ASSERT_FALSE(read.ok()) << size;
    ExpectMalformed(read.status(), "g.sparkdsg: byte ");
  }
  ExpectMalformed(ReadSparkBinary(bytes + '\0', "g.sparkdsg").status(), "goes on after its end");
}

TEST(SparkBinary, NamesTheClassThatIsNone) {
  std::string bytes = WriteSparkBinary(SampleSparkGraph());
  bytes.replace(bytes.find("RoomNode"), 8, "WallNode");
  ExpectMalformed(ReadSparkBinary(bytes, "g.sparkdsg").status(), "node class is none");
  bytes.replace(bytes.find("EdgeAttributes"), 14, "EdgeAttributez");
  EXPECT_FALSE(ReadSparkBinary(bytes, "g.sparkdsg").ok());
}

TEST(SparkBinary, ChecksEveryLengthAgainstTheBytesThatAreLeft) {
  const std::string good = WriteSparkBinary(SampleSparkGraph());
  size_t changed_count = 0;
  for (size_t i = 0; i + 5 <= good.size(); ++i) {
    if (good[i] != '\xdd') continue;
    std::string bytes = good;
    bytes.replace(i + 1, 4, "\xff\xff\xff\xff");
    EXPECT_FALSE(ReadSparkBinary(bytes, "g.sparkdsg").ok()) << "length at byte " << i;
    ++changed_count;
  }
  EXPECT_GT(changed_count, 50u);
}

TEST(SparkBinary, RefusesTextThatIsNotUtf8) {
  SparkGraph graph = SampleSparkGraph();
  graph.nodes[0].name = "caf\xe9";
  ExpectMalformed(ReadSparkBinary(WriteSparkBinary(graph), "g").status(), "name is not UTF-8");
}

TEST(SparkBinary, SurvivesRandomDamage) {
  constexpr uint64_t kSeed = 20200717;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  const std::string good = WriteSparkBinary(SampleSparkGraph());
  int refused_count = 0;
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string bytes = good;
    const uint64_t flip_count = 1 + random() % 4;
    for (uint64_t i = 0; i < flip_count; ++i) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    if (random() % 8 == 0) bytes.resize(random() % bytes.size());
    const auto read = ReadSceneGraph(bytes, "g.sparkdsg", 2.0);
    if (!read.ok()) {
      ++refused_count;
      EXPECT_EQ(ReasonOf(read.status()), Reason::kFileMalformed) << read.status();
    } else {
      // What is let through must be fit to be written.
      const absl::Status status = CheckImport(*read);
      EXPECT_TRUE(status.ok()) << "trial " << trial << ": " << status;
    }
  }
  EXPECT_GT(refused_count, kTrials / 4);
  EXPECT_LT(refused_count, kTrials);
}

}  // namespace
}  // namespace dsg
