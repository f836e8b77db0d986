// SPDX-License-Identifier: Apache-2.0
// Proofs that no other poses would have cost less, for graphs that are small enough.
// Source: Rosen et al. 2019 (SE-Sync), section 4: where Q - Lambda is positive semidefinite and
// annihilates the rotations, they are the best ones there are.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cstdlib>
#include <filesystem>

#include "ingest/loop/g2o_file.h"
#include "ingest/loop/optimize.h"

namespace dsg::ingest {
namespace {

using Eigen::MatrixXd;

// The sum of SE-Sync as trace(X M X'), X = [translations | rotations].
MatrixXd QuadraticForm(const PoseGraph& graph) {
  const int d = graph.is_planar ? 2 : 3;
  const int n = static_cast<int>(graph.poses.size());
  MatrixXd form = MatrixXd::Zero(n + d * n, n + d * n);
  for (const RelativePose& edge : graph.edges) {
    const SeSyncWeights weights = WeightsOf(edge, graph.is_planar);
    MatrixXd columns = MatrixXd::Zero(n + d * n, 1 + d);
    columns(edge.to, 0) = 1.0;
    columns(edge.from, 0) = -1.0;
    columns.block(n + d * edge.from, 0, d, 1) = -edge.from_T_to.position.head(d);
    columns.block(n + d * edge.to, 1, d, d) = MatrixXd::Identity(d, d);
    columns.block(n + d * edge.from, 1, d, d) =
        -edge.from_T_to.orientation.toRotationMatrix().topLeftCorner(d, d);
    columns.col(0) *= std::sqrt(weights.tau);
    columns.rightCols(d) *= std::sqrt(weights.kappa);
    form.selfadjointView<Eigen::Lower>().rankUpdate(columns);
  }
  return form.selfadjointView<Eigen::Lower>();
}

MatrixXd RotationsOf(const PoseGraph& graph, const std::vector<Pose3d>& poses) {
  const int d = graph.is_planar ? 2 : 3;
  MatrixXd rotations(d, d * static_cast<int>(poses.size()));
  for (size_t i = 0; i < poses.size(); ++i) {
    rotations.middleCols(static_cast<int>(i) * d, d) =
        poses[i].orientation.toRotationMatrix().topLeftCorner(d, d);
  }
  return rotations;
}

class CertificateTest : public testing::TestWithParam<const char*> {};

TEST_P(CertificateTest, HoldsForThePosesThatWereFound) {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no real data; set DSG_DATA";
  const auto file = ReadG2o((folder / "posegraphs" / GetParam()).string());
  ASSERT_TRUE(file.ok()) << file.status();
  const PoseGraph& graph = file->graph;
  const auto optimized = Optimize(
      graph,
      {.objective = PoseObjective::kSeSync, .iteration_count_max = 2000, .tolerance = 1e-15});
  ASSERT_TRUE(optimized.ok()) << optimized.status();

  const int d = graph.is_planar ? 2 : 3;
  const int n = static_cast<int>(graph.poses.size());
  const MatrixXd form = QuadraticForm(graph);
  // The best translations for given rotations, put in; the first pose is where it is.
  const MatrixXd across = form.block(1, n, n - 1, d * n);
  const MatrixXd q = form.bottomRightCorner(d * n, d * n) -
                     across.transpose() * form.block(1, 1, n - 1, n - 1).llt().solve(across);
  const MatrixXd rotations = RotationsOf(graph, optimized->poses);
  EXPECT_NEAR((rotations * q * rotations.transpose()).trace(), 2.0 * optimized->cost,
              1e-7 * optimized->cost);
  MatrixXd certificate = q;
  const MatrixXd gradient = q * rotations.transpose() * rotations;
  for (int i = 0; i < n; ++i) {
    const MatrixXd block = gradient.block(d * i, d * i, d, d);
    certificate.block(d * i, d * i, d, d) -= 0.5 * (block + block.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(certificate, Eigen::EigenvaluesOnly);
  const Eigen::VectorXd& values = solver.eigenvalues();
  EXPECT_LT((certificate * rotations.transpose()).norm(), 1e-4 * values[d * n - 1]);
  EXPECT_GT(values[0], -1e-7 * values[d * n - 1]) << values.head(d + 2).transpose();
}

// Not the graphs of Kimera-RPGO, whose contradicting loops leave no poses that could be certified.
INSTANTIATE_TEST_SUITE_P(Data, CertificateTest,
                         testing::Values("tinyGrid3D.g2o", "smallGrid3D.g2o", "vertigo_ring.g2o"));

}  // namespace
}  // namespace dsg::ingest
