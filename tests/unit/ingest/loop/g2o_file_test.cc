// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/g2o_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "ingest/loop/optimize.h"
#include "ingest/loop/residual.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

constexpr char kFlat[] = " 1 0 0 1 0 1\n";
constexpr char kSolid[] = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";

class G2oTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }

  absl::StatusOr<G2oFile> Read(const std::string& text) const {
    std::ofstream(Path("graph.g2o"), std::ios::binary) << text;
    return ReadG2o(Path("graph.g2o"));
  }

  void ExpectMalformed(const std::string& text, const std::string& part) const {
    const auto file = Read(text);
    ASSERT_FALSE(file.ok()) << text;
    EXPECT_EQ(ReasonOf(file.status()), Reason::kFileMalformed) << file.status();
    EXPECT_NE(file.status().message().find(part), absl::string_view::npos) << file.status();
  }

  test::TempFolder folder_;
};

TEST_F(G2oTest, GivesBackWhatWasWritten) {
  Random random(test::TestSeed(51), 0);
  for (const bool is_planar : {false, true}) {
    PoseGraph graph =
        RandomGraph({.is_planar = is_planar, .noise_m = 0.1, .noise_rad = 0.1}, &random);
    for (int64_t& id : graph.ids) id = 3 * id + 7;
    ASSERT_TRUE(WriteG2o(graph, Path("out.g2o")).ok());
    const auto file = ReadG2o(Path("out.g2o"));
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_TRUE(file->has_start);
    EXPECT_TRUE(file->skipped.empty());
    EXPECT_TRUE(file->notes.empty());
    EXPECT_EQ(file->graph.is_planar, is_planar);
    EXPECT_EQ(file->graph.ids, graph.ids);
    EXPECT_LT(LargestDifference(file->graph.poses, graph.poses), 1e-14);
    ASSERT_EQ(file->graph.edges.size(), graph.edges.size());
    for (size_t i = 0; i < graph.edges.size(); ++i) {
      const RelativePose& read = file->graph.edges[i];
      const RelativePose& written = graph.edges[i];
      EXPECT_EQ(read.from, written.from);
      EXPECT_EQ(read.to, written.to);
      EXPECT_EQ(read.is_loop, written.is_loop);
      EXPECT_EQ(read.line, static_cast<int64_t>(graph.poses.size() + i + 1));
      EXPECT_LT(LargestDifference({read.from_T_to}, {written.from_T_to}), 1e-14);
      if (is_planar) {
        EXPECT_EQ(PlanarBlock(read.information), PlanarBlock(written.information));
      } else {
        EXPECT_EQ(read.information, written.information);
      }
    }
    ASSERT_TRUE(WriteG2o(file->graph, Path("again.g2o")).ok());
    const auto again = ReadG2o(Path("again.g2o"));
    ASSERT_TRUE(again.ok());
    EXPECT_NEAR(CostOf(again->graph, again->graph.poses, {}, PoseObjective::kGeodesic),
                CostOf(graph, graph.poses, {}, PoseObjective::kGeodesic), 1e-9);
  }
}

TEST_F(G2oTest, OrdersPosesByTheirIdsUpToTheLargest) {
  const auto file = Read(std::string("EDGE_SE2 9223372036854775807 5 1 0 0") + kFlat +
                         "VERTEX_SE2 9223372036854775807 9 0 0\nVERTEX_SE2 5 1 2 0.5\n");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->graph.ids, (std::vector<int64_t>{5, 9223372036854775807}));
  EXPECT_NEAR(file->graph.poses[0].position.y(), 2.0, 0.0);
  EXPECT_EQ(file->graph.edges[0].from, 1);
  EXPECT_EQ(file->graph.edges[0].to, 0);
}

TEST_F(G2oTest, FindsPosesFromEdgesWhereNoVertexIsGiven) {
  const auto file = Read(std::string("EDGE_SE2 0 1 1 0 1.5707963267948966") + kFlat +
                         "EDGE_SE2 1 2 2 0 0" + kFlat + "EDGE_SE2 0 2 9 9 0" + kFlat);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_FALSE(file->has_start);
  ASSERT_EQ(file->graph.poses.size(), 3u);
  EXPECT_LT((file->graph.poses[2].position - Eigen::Vector3d(1, 2, 0)).norm(), 1e-12);
}

TEST_F(G2oTest, TellsLoopsByTheOrderOfIdsAndTheRobotsLetter) {
  const auto file =
      Read(std::string("EDGE_SE2 10 20 1 0 0") + kFlat + "EDGE_SE2 30 20 1 0 0" + kFlat +
           "EDGE_SE2 10 30 1 0 0" + kFlat + "EDGE_SE2 30 6989586621679009792 1 0 0" + kFlat);
  ASSERT_TRUE(file.ok()) << file.status();
  std::vector<bool> loops;
  for (const RelativePose& edge : file->graph.edges) loops.push_back(edge.is_loop);
  EXPECT_EQ(loops, (std::vector<bool>{false, false, true, true}));
}

TEST_F(G2oTest, ReadsCommentsBlankLinesAndLineEndsOfWindows) {
  const auto file = Read(
      "# made by hand\r\n\r\n   \t\r\nEDGE_SE2 0 1 +1 2e0 .5 1 0 0 1 0 1 # good one\r\n"
      "EDGE_SE2 1 2 1 0 4.9e-324 1 0 0 1 0 1");
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->graph.edges.size(), 2u);
  EXPECT_EQ(file->graph.edges[0].from_T_to.position, Eigen::Vector3d(1, 2, 0));
  EXPECT_EQ(file->graph.edges[1].line, 5);
}

TEST_F(G2oTest, HoldsThePoseOfTheFirstFixLineThatNamesOne) {
  const auto file = Read(std::string("FIX 8\nFIX 2\nFIX 1\nEDGE_SE2 1 2 1 0 0") + kFlat);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->fixed_pose, 1);
  EXPECT_EQ(file->skipped.at("FIX of an unknown pose"), 1);
}

TEST_F(G2oTest, CountsWhatItLeavesOut) {
  const std::string bad_matrix = "EDGE_SE2 0 1 1 0 0 1 2 0 1 0 1\n";
  const auto file = Read("VERTEX_XY 4 1 2\nEDGE_SE2_XY 1 4 1 1 1 0 1\nPARAMS 1\n" + bad_matrix +
                         bad_matrix + "EDGE_SE2 0 1 1 0 0 0 0 0 0 0 0\nEDGE_SE2 1 1 1 0 0" + kFlat +
                         "EDGE_SE2 0 1 1 0 0" + kFlat);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->graph.edges.size(), 1u);
  EXPECT_EQ(file->skipped,
            (std::map<std::string, int64_t>{{"line of another kind", 3},
                                            {"information matrix not positive definite", 3},
                                            {"edge from a pose to itself", 1}}));
  ASSERT_EQ(file->notes.size(), 3u);
  EXPECT_NE(file->notes[0].find("line 1: left out: line of another kind \"VERTEX_XY\""),
            std::string::npos)
      << file->notes[0];
  EXPECT_NE(file->notes[1].find("line 4"), std::string::npos) << file->notes[1];
}

TEST_F(G2oTest, SkipsIndefiniteSpatialInformation) {
  const auto file =
      Read(std::string("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1") + kSolid +
           "EDGE_SE3:QUAT 1 2 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 5 1 0 1\n" +
           "EDGE_SE3:QUAT 1 2 1 0 0 0 0 0 1" + kSolid);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->graph.edges.size(), 2u);
  EXPECT_EQ(file->skipped.at("information matrix not positive definite"), 1);
}

TEST_F(G2oTest, KeepsPartsThatHangApartAndTells) {
  const auto file = Read(std::string("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nVERTEX_SE2 2 5 0 0\n"
                                     "VERTEX_SE2 3 6 0 0\nVERTEX_SE2 4 7 7 0\nEDGE_SE2 0 1 1 0 0") +
                         kFlat + "EDGE_SE2 2 3 1 0 0" + kFlat);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->graph.poses.size(), 5u);
  ASSERT_EQ(file->notes.size(), 2u);
  EXPECT_NE(file->notes[0].find("1 of 5 poses have no edge"), std::string::npos);
  EXPECT_NE(file->notes[1].find("2 parts"), std::string::npos);
}

TEST_F(G2oTest, NamesFileLineFieldAndValueOfABadNumber) {
  ExpectMalformed(std::string("EDGE_SE2 0 1 1 0 0") + kFlat + "EDGE_SE2 1 2 1 north 0" + kFlat,
                  "graph.g2o:2: field y is \"north\"");
  ExpectMalformed(std::string("EDGE_SE2 0 1 nan 0 0") + kFlat, "field x is \"nan\"");
  ExpectMalformed(std::string("EDGE_SE2 0 1 1 0 inf") + kFlat, "field theta is \"inf\"");
  ExpectMalformed(std::string("EDGE_SE2 0 1 1 0 1e999") + kFlat, "field theta is \"1e999\"");
  ExpectMalformed(std::string("EDGE_SE2 0 1 1 1x 0") + kFlat, "field y is \"1x\"");
  ExpectMalformed(std::string("EDGE_SE2 0 1 3e7 0 0") + kFlat, "field x is \"3e7\"");
  ExpectMalformed("EDGE_SE2 0 1 1 0 0 1 0 nan 1 0 1\n", "field I13 is \"nan\"");
  ExpectMalformed(std::string("EDGE_SE2 0 -1 1 0 0") + kFlat, "field to is \"-1\"");
  ExpectMalformed(std::string("EDGE_SE2 0 9223372036854775808 1 0 0") + kFlat, "field to is");
}

TEST_F(G2oTest, RefusesLinesOfAnotherLength) {
  ExpectMalformed("EDGE_SE2 0 1 1 0 0 1 0 0 1 0\n", "field I33 is missing");
  ExpectMalformed("EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1 7\n", "\"7\"");
  ExpectMalformed("VERTEX_SE2 0 1\n", "field y is missing");
  ExpectMalformed("VERTEX_SE2\n", "field id is missing");
}

TEST_F(G2oTest, RefusesAVertexThatIsMissingOrTwiceThere) {
  ExpectMalformed(std::string("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nEDGE_SE2 0 2 1 0 0") + kFlat,
                  "graph.g2o:3: field to is 2");
  ExpectMalformed(std::string("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nVERTEX_SE2 0 1 0 0\n"
                              "EDGE_SE2 0 1 1 0 0") +
                      kFlat,
                  "graph.g2o:3: vertex 0 for the second time; it is in line 1");
}

TEST_F(G2oTest, RefusesPlanarAndSpatialLinesTogether) {
  ExpectMalformed(std::string("VERTEX_SE2 0 0 0 0\nEDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1") + kSolid,
                  "graph.g2o:2: a spatial line in a planar graph (line 1)");
}

TEST_F(G2oTest, RefusesQuaternionsThatAreNotUnit) {
  ExpectMalformed(std::string("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1.1") + kSolid, "norm");
  ExpectMalformed(std::string("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 0") + kSolid, "norm");
  const auto rounded = Read(std::string("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0.70711 0.70711") + kSolid);
  ASSERT_TRUE(rounded.ok()) << rounded.status();
  EXPECT_NEAR(rounded->graph.edges[0].from_T_to.orientation.norm(), 1.0, 1e-15);
}

TEST_F(G2oTest, RefusesFilesWithoutMeasurements) {
  ExpectMalformed("", "not one usable EDGE");
  ExpectMalformed("VERTEX_SE2 0 0 0 0\n", "not one usable EDGE");
  ExpectMalformed("EDGE_SE2 0 1 1 0 0 0 0 0 0 0 0\n", "not one usable EDGE");
  ExpectMalformed(std::string(100'000, 'x'), "graph.g2o:1: a line of more than");
}

TEST_F(G2oTest, SaysWhichFileIsNotThere) {
  EXPECT_EQ(ReadG2o(Path("none.g2o")).status().code(), absl::StatusCode::kNotFound);
  const auto folder = ReadG2o(folder_.path());
  ASSERT_FALSE(folder.ok());
  EXPECT_NE(folder.status().message().find(folder_.path()), absl::string_view::npos);
  EXPECT_FALSE(WriteG2o(PoseGraph(), Path("no/such/folder.g2o")).ok());
}

// Any bytes: an answer or an error, and a graph that the solver takes.
TEST_F(G2oTest, NeverCrashesOnChangedBytes) {
  const uint64_t seed = test::TestSeed(52);
  Random random(seed, 0);
  std::vector<std::string> sound;
  for (int i = 0; i < 20; ++i) {
    const RandomGraphOptions options{
        .is_planar = i % 2 == 0, .pose_count = 5, .loop_count = 3, .noise_m = 0.1};
    ASSERT_TRUE(WriteG2o(RandomGraph(options, &random), Path("sound.g2o")).ok());
    std::ostringstream whole;
    whole << std::ifstream(Path("sound.g2o"), std::ios::binary).rdbuf();
    sound.push_back(whole.str());
  }
  for (int round = 0; round < 4000; ++round) {
    std::string bytes = sound[static_cast<size_t>(random.Index(20))];
    for (int change = random.Integer(1, 6); change > 0 && !bytes.empty(); --change) {
      const auto at = static_cast<size_t>(random.Index(static_cast<int>(bytes.size())));
      const int kind = random.Index(5);
      if (kind == 0) bytes[at] = static_cast<char>(random.Integer(0, 255));
      if (kind == 1) bytes.erase(at, static_cast<size_t>(random.Integer(1, 40)));
      if (kind == 2) bytes.insert(at, bytes.substr(at / 2, static_cast<size_t>(random.Index(60))));
      if (kind == 3) bytes[at] = "0123456789e+-. \n"[random.Index(16)];
      if (kind == 4) bytes.resize(at);
    }
    std::istringstream in(bytes);
    const auto file = ReadG2oStream(&in, "changed");
    if (!file.ok()) {
      EXPECT_TRUE(ReasonOf(file.status()) == Reason::kFileMalformed) << file.status();
      continue;
    }
    const auto optimized = Optimize(file->graph, {.iteration_count_max = 3});
    EXPECT_TRUE(optimized.ok()) << "seed " << seed << " round " << round << ": "
                                << optimized.status() << "\n"
                                << bytes;
  }
}

}  // namespace
}  // namespace dsg::ingest
