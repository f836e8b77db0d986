// SPDX-License-Identifier: Apache-2.0
// Public pose graphs spoilt by random wrong loops; prints a table. By the environment:
// DSG_ROBUST_SETS=all or names, "intel,CSAIL"; DSG_ROBUST_SHARES of wrong loops, "0.1,0.6";
// DSG_ROBUST_SEEDS, "11,12"; DSG_ROBUST_GROUP, how many wrong loops agree with one another.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "ingest/loop/chi_square.h"
#include "ingest/loop/g2o_file.h"
#include "ingest/loop/robust.h"
#include "tests/unit/ingest/loop/wrong_loops.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

std::string FromEnvironment(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : otherwise;
}

std::vector<std::string> Words(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

fs::path SetsFolder() {
  return fs::path(FromEnvironment("DSG_DATA", std::string(DSG_SOURCE_DIR) + "/../shared/data")) /
         "posegraphs";
}

// Where the poses truly were; empty when nobody knows.
std::vector<Pose3d> TruthOf(const std::string& name) {
  if (name == "vertigo_ring") {
    const absl::StatusOr<G2oFile> file = ReadG2o(SetsFolder() / "vertigo_ring_groundtruth.g2o");
    return file.ok() ? file->graph.poses : std::vector<Pose3d>();
  }
  std::vector<Pose3d> poses;
  if (name != "manhattan") return poses;
  std::ifstream stream(SetsFolder() / "manhattanOlson3500_nodes_groundTruth.dat");
  Pose3d pose;
  double yaw_rad = 0.0;
  while (stream >> pose.position.x() >> pose.position.y() >> yaw_rad) {
    pose.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
    poses.push_back(pose);
  }
  return poses;
}

struct Case {
  std::string name;
  double share = 0.0;
  uint64_t seed = 0;
  int group_size = 1;
};

struct Outcome {
  double precision = 1.0;
  double recall = 1.0;
  // Against the truth where it is known, otherwise the clean solution.
  double error_m = 0.0;
  double clean_error_m = 0.0;
  // Cost of the true edges, against that of the clean solution.
  double cost_ratio = 1.0;
  double seconds = 0.0;
  int64_t consistency_count = 0;
  int64_t graduation_count = 0;
};

struct CleanSet {
  PoseGraph graph;
  std::vector<Pose3d> poses;
  double cost = 0.0;
  double seconds = 0.0;
};

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double DiagonalOf(const std::vector<Pose3d>& poses) {
  Eigen::AlignedBox3d box;
  for (const Pose3d& pose : poses) box.extend(pose.position);
  return box.diagonal().norm();
}

absl::StatusOr<CleanSet> SolveClean(const std::string& name) {
  absl::StatusOr<G2oFile> file = ReadG2o(SetsFolder() / (name + ".g2o"));
  if (!file.ok()) return file.status();
  CleanSet clean;
  clean.graph = std::move(file->graph);
  const auto start = std::chrono::steady_clock::now();
  absl::StatusOr<Optimized> optimized = Optimize(clean.graph, {});
  if (!optimized.ok()) return optimized.status();
  clean.seconds = SecondsSince(start);
  clean.poses = optimized->poses;
  clean.cost = optimized->cost;
  return clean;
}

absl::StatusOr<Outcome> MeasureCase(const CleanSet& clean, const Case& spoilt_case) {
  const double gate = ChiSquareGate(RobustOptions().confidence, clean.graph.is_planar);
  WrongLoopOptions wrong;
  wrong.share = spoilt_case.share;
  wrong.seed = spoilt_case.seed;
  wrong.group_size = spoilt_case.group_size;
  const PoseGraph spoilt = WithWrongLoops(clean.graph, clean.poses, gate, wrong);
  const auto start = std::chrono::steady_clock::now();
  absl::StatusOr<RobustResult> result = OptimizeRobustly(spoilt, {});
  if (!result.ok()) return result.status();
  Outcome outcome;
  outcome.seconds = SecondsSince(start);
  int64_t true_count = 0;
  int64_t true_kept_count = 0;
  for (size_t e = 0; e < clean.graph.edges.size(); ++e) {
    if (!spoilt.edges[e].is_loop) continue;
    ++true_count;
    true_kept_count += result->is_kept[e] ? 1 : 0;
  }
  for (size_t e = clean.graph.edges.size(); e < spoilt.edges.size(); ++e) {
    if (!result->is_kept[e]) continue;
    const RelativePose& edge = spoilt.edges[e];
    std::printf("  kept a wrong loop %d-%d, squared residual %.1f at the clean solution\n",
                edge.from, edge.to,
                SquaredResidual(edge, spoilt.is_planar, clean.poses[static_cast<size_t>(edge.from)],
                                clean.poses[static_cast<size_t>(edge.to)]));
  }
  const auto ratio = [](int64_t part, int64_t whole) {
    return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
  };
  outcome.precision = ratio(true_kept_count, result->kept_count);
  outcome.recall = ratio(true_kept_count, true_count);
  outcome.consistency_count = result->rejected_by_consistency_count;
  outcome.graduation_count = result->rejected_by_graduation_count;
  const std::vector<Pose3d>& poses = result->optimized.poses;
  const std::vector<Pose3d> truth = TruthOf(spoilt_case.name);
  outcome.error_m = PositionError(poses, truth.empty() ? clean.poses : truth);
  outcome.clean_error_m = truth.empty() ? 0.0 : PositionError(clean.poses, truth);
  outcome.cost_ratio =
      CostOf(clean.graph, poses, {}, PoseObjective::kGeodesic) / std::max(clean.cost, 1e-12);
  return outcome;
}

void RunCases(const std::vector<std::string>& names, const std::vector<std::string>& shares,
              const std::vector<std::string>& seeds, int group_size) {
  for (const std::string& name : names) {
    const absl::StatusOr<CleanSet> clean = SolveClean(name);
    ASSERT_TRUE(clean.ok()) << clean.status();
    std::printf("%s: clean cost %.6g, %.2f s\n", name.c_str(), clean->cost, clean->seconds);
    for (const std::string& share : shares) {
      for (const std::string& seed : seeds) {
        const Case spoilt{name, std::stod(share), std::stoull(seed), group_size};
        const absl::StatusOr<Outcome> outcome = MeasureCase(*clean, spoilt);
        ASSERT_TRUE(outcome.ok()) << outcome.status();
        std::printf(
            "%s wrong %.2f seed %s: precision %.4f recall %.4f error %.4f m (clean %.4f) cost x "
            "%.5f, %.2f s, rejected %lld + %lld\n",
            name.c_str(), spoilt.share, seed.c_str(), outcome->precision, outcome->recall,
            outcome->error_m, outcome->clean_error_m, outcome->cost_ratio, outcome->seconds,
            static_cast<long long>(outcome->consistency_count),
            static_cast<long long>(outcome->graduation_count));
        std::fflush(stdout);
        if (group_size > 1) continue;
        EXPECT_EQ(outcome->precision, 1.0);
        EXPECT_GE(outcome->recall, 0.9);
        // Where nobody knows the truth, the clean solution is it.
        const double error_m_max = outcome->clean_error_m > 0.0 ? 2.0 * outcome->clean_error_m
                                                                : 0.01 * DiagonalOf(clean->poses);
        EXPECT_LE(outcome->error_m, error_m_max);
        if (spoilt.share == 0.0) {
          EXPECT_NEAR(outcome->cost_ratio, 1.0, 1e-5);
        }
      }
    }
  }
}

TEST(RobustSets, KeepsNoRandomWrongLoopOfPublicGraphs) {
  if (!fs::exists(SetsFolder())) GTEST_SKIP() << "No pose graphs in " << SetsFolder();
  const std::string names = FromEnvironment("DSG_ROBUST_SETS", "intel,CSAIL,MIT,vertigo_ring");
  const std::string all =
      "smallGrid3D,MIT,CSAIL,vertigo_ring,intel,manhattan,sphere2500,parking-garage";
  const std::string shares = FromEnvironment(
      "DSG_ROBUST_SHARES", names == "all" ? "0,0.1,0.2,0.3,0.4,0.5,0.6" : "0,0.3,0.6");
  RunCases(Words(names == "all" ? all : names), Words(shares),
           Words(FromEnvironment("DSG_ROBUST_SEEDS", "1")),
           std::stoi(FromEnvironment("DSG_ROBUST_GROUP", "1")));
}

}  // namespace
}  // namespace dsg::ingest
