// SPDX-License-Identifier: Apache-2.0
// The usual benchmark graphs against their known optima.
// Source: Rosen et al. 2019 (SE-Sync), tables 2 and 3; the data's README for the rest.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "ingest/loop/g2o_file.h"
#include "ingest/loop/optimize.h"

namespace dsg::ingest {
namespace {

constexpr double kGap = 1e-5;

struct KnownGraph {
  const char* name;
  size_t pose_count;
  size_t edge_count;
  /// Whole sums, not halves; 0 = not known.
  double se_sync;
  double g2o;
};

std::filesystem::path DataFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

class KnownGraphTest : public testing::TestWithParam<KnownGraph> {
 protected:
  // Ends within kGap of `known`, to the digits that are known.
  static void Expect(const PoseGraph& graph, PoseObjective objective, const char* what,
                     double known) {
    const auto begin = std::chrono::steady_clock::now();
    const auto optimized = Optimize(graph, {.objective = objective, .iteration_count_max = 500});
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    ASSERT_TRUE(optimized.ok()) << optimized.status();
    const double sum = 2.0 * optimized->cost;
    std::printf("%s %s: %.8g, known %.8g, gap %.1e, %d steps, %.3f s\n", GetParam().name, what, sum,
                known, sum / known - 1.0, optimized->iteration_count, elapsed.count());
    EXPECT_TRUE(optimized->is_converged);
    EXPECT_LT(std::abs(sum - known), kGap * known);
  }
};

TEST_P(KnownGraphTest, EndsAtItsKnownOptimum) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const KnownGraph& known = GetParam();
  const auto file =
      ReadG2o((DataFolder() / "posegraphs" / (std::string(known.name) + ".g2o")).string());
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_TRUE(file->skipped.empty());
  EXPECT_EQ(file->graph.poses.size(), known.pose_count);
  EXPECT_EQ(file->graph.edges.size(), known.edge_count);
  Expect(file->graph, PoseObjective::kSeSync, "F", known.se_sync);
  if (known.g2o > 0.0) Expect(file->graph, PoseObjective::kQuaternion, "chi2", known.g2o);
}

// kimera_rpgo_robot_b: what the chordal start leads to, below the README's 34.0729. Its loops
// contradict each other, and starts drawn at random find 20.1948.
INSTANTIATE_TEST_SUITE_P(Data, KnownGraphTest,
                         testing::Values(KnownGraph{"sphere2500", 2500, 4949, 1687.006, 727.150},
                                         KnownGraph{"parking-garage", 1661, 6275, 1.262524,
                                                    1.23869},
                                         KnownGraph{"smallGrid3D", 125, 297, 1025.398, 458.154},
                                         KnownGraph{"tinyGrid3D", 9, 11, 18.51937, 6.72788},
                                         KnownGraph{"intel", 1728, 2512, 52.34823, 45.0047},
                                         KnownGraph{"CSAIL", 1045, 1172, 31.70372, 40.5551},
                                         KnownGraph{"manhattan", 3500, 5453, 6431.391, 3549.04},
                                         KnownGraph{"MIT", 808, 827, 61.15412, 41.1633},
                                         KnownGraph{"vertigo_ring", 434, 459, 11.25752, 0.0},
                                         KnownGraph{"kimera_rpgo_robot_a", 50, 52, 46.47087, 0.0},
                                         KnownGraph{"kimera_rpgo_robot_b", 42, 43, 33.82008, 0.0}),
                         [](const testing::TestParamInfo<KnownGraph>& known) {
                           std::string name = known.param.name;
                           for (char& c : name) c = c == '-' ? '_' : c;
                           return name;
                         });

TEST(TrueGraph, CostsNothing) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const auto file = ReadG2o((DataFolder() / "posegraphs/vertigo_ring_groundtruth.g2o").string());
  ASSERT_TRUE(file.ok()) << file.status();
  const auto optimized = Optimize(file->graph, {.objective = PoseObjective::kSeSync});
  ASSERT_TRUE(optimized.ok());
  EXPECT_LT(optimized->cost, 1e-9);
}

TEST(UnorderedGraph, IsTheOrderedOne) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const std::filesystem::path folder = DataFolder() / "posegraphs";
  double costs[2] = {};
  for (const int i : {0, 1}) {
    const auto file = ReadG2o(
        (folder / (i == 0 ? "kimera_rpgo_ordered.g2o" : "kimera_rpgo_unordered.g2o")).string());
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_EQ(file->graph.poses.size(), 140u);
    EXPECT_EQ(file->graph.edges.size(), 153u);
    ASSERT_EQ(file->notes.size(), 1u);
    EXPECT_NE(file->notes[0].find("3 of 140 poses"), std::string::npos) << file->notes[0];
    const auto optimized = Optimize(file->graph, {.objective = PoseObjective::kSeSync});
    ASSERT_TRUE(optimized.ok()) << optimized.status();
    costs[i] = optimized->cost;
  }
  EXPECT_NEAR(costs[0], costs[1], kGap * costs[0]);
  EXPECT_NEAR(2.0 * costs[0], 0.1159714, 1e-6);
}

}  // namespace
}  // namespace dsg::ingest
