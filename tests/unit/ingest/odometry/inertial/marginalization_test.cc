// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/marginalization.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <string>

#include "ingest/odometry/inertial/inertial_factor.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"
#include "tests/unit/ingest/odometry/inertial/window_factors.h"

namespace dsg::ingest {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Five states 0.2 s apart and eight landmarks, somewhat off what was measured. Landmarks 0 to 3 are
// seen by states 0 to 2, the others by all.
struct Window {
  static constexpr int kStateCount = 5;
  static constexpr int kLandmarkCount = 8;
  static constexpr int kOwnLandmarkCount = 4;

  std::deque<std::array<double, kPoseBlockSize>> poses;
  std::deque<std::array<double, kSpeedBlockSize>> speeds;
  std::deque<std::array<double, 3>> landmarks;
  std::deque<Preintegration> measured;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs;
  std::unique_ptr<ceres::LossFunction> loss = std::make_unique<ceres::HuberLoss>(1.0);
  std::vector<WindowFactor> factors;

  void Add(std::unique_ptr<ceres::CostFunction> cost, std::vector<double*> blocks,
           bool is_robust = false) {
    factors.push_back({cost.get(), is_robust ? loss.get() : nullptr, std::move(blocks)});
    costs.push_back(std::move(cost));
  }
  // The landmarks that leave with the first state, then that state.
  std::vector<double*> First() {
    std::vector<double*> blocks;
    for (int i = 0; i < kOwnLandmarkCount; ++i) blocks.push_back(landmarks[Size(i)].data());
    blocks.push_back(poses[0].data());
    blocks.push_back(speeds[0].data());
    return blocks;
  }
  static size_t Size(int i) { return static_cast<size_t>(i); }
};

// `is_anchored`: the first pose and speed are known; otherwise its biases are, and nothing tells
// position and yaw.
void FillWindow(bool is_anchored, Random* random, Window* window) {
  const Vector3d gravity(0.0, 0.0, -9.81);
  const auto samples = SwungSamples(1.0, 200.0);
  std::vector<InertialState> truth = {AnyState(random)};
  for (int i = 0; i + 1 < Window::kStateCount; ++i) {
    const TimeNs from_ns = i * TimeNs{200'000'000};
    auto part = Preintegration::Make(samples, from_ns, from_ns + 200'000'000, truth[0].bias,
                                     Adis16448(), {});
    ASSERT_TRUE(part.ok()) << part.status();
    truth.push_back(part->Predict(truth.back(), gravity, nullptr));
    window->measured.push_back(*std::move(part));
  }
  Vector15d off;
  for (const InertialState& state : truth) {
    off = RandomStep15(0.01, random);
    off.tail<9>() *= 0.1;
    const InertialState guess = Stepped(state, off);
    WritePoseBlock(guess.map_T_imu, window->poses.emplace_back().data());
    WriteSpeedBlock(guess, window->speeds.emplace_back().data());
  }
  if (is_anchored) {
    window->Add(std::make_unique<PoseAnchor>(truth[0].map_T_imu, 0.01, 0.01),
                {window->poses[0].data()});
  }
  window->Add(std::make_unique<SpeedAnchor>(truth[0], is_anchored ? 0 : 3),
              {window->speeds[0].data()});
  for (size_t i = 0; i < window->measured.size(); ++i) {
    window->Add(MakeInertialFactor(&window->measured[i], gravity),
                {window->poses[i].data(), window->speeds[i].data(), window->poses[i + 1].data(),
                 window->speeds[i + 1].data()});
  }
  for (int k = 0; k < Window::kLandmarkCount; ++k) {
    const Vector3d landmark = truth[0].map_T_imu * Vector3d(3.0, 0.7 * k - 2.5, k % 3 - 1.0);
    std::array<double, 3>& block = window->landmarks.emplace_back();
    Eigen::Map<Vector3d>{block.data()} = landmark + NormalVector(0.02, random);
    const int seen_by = k < Window::kOwnLandmarkCount ? 3 : Window::kStateCount;
    for (size_t i = 0; i < Window::Size(seen_by); ++i) {
      const Vector3d seen = truth[i].map_T_imu.Inverse() * landmark + NormalVector(0.01, random);
      window->Add(std::make_unique<PointFactor>(seen), {window->poses[i].data(), block.data()},
                  true);
    }
  }
}

// A dense linear system over all blocks, put together without the code under test.
struct Dense {
  std::vector<double*> blocks;
  std::map<const double*, int> column;
  MatrixXd jacobian;
  VectorXd residual;
};

Dense DenseOf(const std::vector<WindowFactor>& factors) {
  Dense dense;
  int row_count = 0;
  int column_count = 0;
  for (const WindowFactor& factor : factors) {
    row_count += factor.cost->num_residuals();
    for (size_t k = 0; k < factor.blocks.size(); ++k) {
      if (!dense.column.emplace(factor.blocks[k], column_count).second) continue;
      dense.blocks.push_back(factor.blocks[k]);
      const int size = factor.cost->parameter_block_sizes()[k];
      column_count += size == 7 ? 6 : size;
    }
  }
  dense.jacobian = MatrixXd::Zero(row_count, column_count);
  dense.residual = VectorXd::Zero(row_count);
  int row = 0;
  for (const WindowFactor& factor : factors) {
    const int rows = factor.cost->num_residuals();
    std::vector<std::vector<double>> numbers;
    std::vector<double*> outputs;
    for (const int size : factor.cost->parameter_block_sizes()) {
      numbers.emplace_back(Window::Size(rows * size));
    }
    for (std::vector<double>& of_block : numbers) outputs.push_back(of_block.data());
    VectorXd residual(rows);
    EXPECT_TRUE(factor.cost->Evaluate(factor.blocks.data(), residual.data(), outputs.data()));
    double weight = 1.0;
    if (factor.loss != nullptr) {
      double rho[3];
      factor.loss->Evaluate(residual.squaredNorm(), rho);
      weight = std::sqrt(rho[1]);
    }
    dense.residual.segment(row, rows) = weight * residual;
    for (size_t k = 0; k < factor.blocks.size(); ++k) {
      const int size = factor.cost->parameter_block_sizes()[k];
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < (size == 7 ? 6 : size); ++c) {
          dense.jacobian(row + r, dense.column.at(factor.blocks[k]) + c) =
              weight * numbers[k][Window::Size(r * size + c)];
        }
      }
    }
    row += rows;
  }
  return dense;
}

bool Touches(const WindowFactor& factor, const std::vector<double*>& blocks) {
  return std::any_of(factor.blocks.begin(), factor.blocks.end(), [&](const double* block) {
    return std::find(blocks.begin(), blocks.end(), block) != blocks.end();
  });
}

// Replaces the factors that touch `dropped` by their prior, which `window` keeps.
std::vector<WindowFactor> WithPrior(const std::vector<WindowFactor>& factors,
                                    const std::vector<double*>& dropped, Window* window) {
  std::vector<WindowFactor> touching;
  std::vector<WindowFactor> others;
  for (const WindowFactor& factor : factors) {
    (Touches(factor, dropped) ? touching : others).push_back(factor);
  }
  auto prior = Marginalize(touching, dropped, {});
  EXPECT_TRUE(prior.ok()) << prior.status();
  EXPECT_LE(prior->jacobian.rows(), prior->jacobian.cols());
  const std::vector<double*> blocks = prior->blocks;
  EXPECT_FALSE(Touches({nullptr, nullptr, blocks}, dropped));
  window->costs.push_back(MakePriorFactor(*std::move(prior)));
  others.push_back({window->costs.back().get(), nullptr, blocks});
  return others;
}

void ExpectSameSteps(const Dense& whole, const Dense& reduced) {
  const VectorXd whole_step = whole.jacobian.colPivHouseholderQr().solve(-whole.residual);
  const VectorXd step = reduced.jacobian.colPivHouseholderQr().solve(-reduced.residual);
  ASSERT_GT(step.norm(), 1e-3);
  for (const double* block : reduced.blocks) {
    const int from = reduced.column.at(block);
    int end = static_cast<int>(step.size());
    for (const auto& [other, column] : reduced.column) {
      if (column > from) end = std::min(end, column);
    }
    const VectorXd difference =
        step.segment(from, end - from) - whole_step.segment(whole.column.at(block), end - from);
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Marginalize, ThenSolveEqualsTheWholeSolve) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(test::TestSeed(seed), 0);
    Window window;
    FillWindow(true, &random, &window);
    const Dense whole = DenseOf(window.factors);
    // Some of the landmarks count less, or the losses prove nothing.
    EXPECT_NE(whole.residual.norm(), 0.0);
    const std::vector<WindowFactor> kept = WithPrior(window.factors, window.First(), &window);
    const Dense reduced = DenseOf(kept);
    EXPECT_EQ(reduced.blocks.size(), whole.blocks.size() - window.First().size());
    ExpectSameSteps(whole, reduced);

    // The next state goes too, and with it what is left of the first one.
    const std::vector<WindowFactor> last =
        WithPrior(kept, {window.poses[1].data(), window.speeds[1].data()}, &window);
    ExpectSameSteps(whole, DenseOf(last));
  }
}

TEST(Marginalize, WeighsFactorsByTheirLoss) {
  Random random(test::TestSeed(6), 0);
  Window window;
  FillWindow(true, &random, &window);
  // A landmark of the first state is half a metre off.
  window.landmarks[0][1] += 0.5;
  ExpectSameSteps(DenseOf(window.factors),
                  DenseOf(WithPrior(window.factors, window.First(), &window)));
  std::vector<WindowFactor> squares = window.factors;
  for (WindowFactor& factor : squares) factor.loss = nullptr;
  const auto robust = Marginalize(window.factors, window.First(), {});
  const auto plain = Marginalize(squares, window.First(), {});
  ASSERT_TRUE(robust.ok() && plain.ok());
  EXPECT_GT((robust->residual - plain->residual).norm(), 1.0);
}

// One step of Ceres with the prior leads where one step with all factors leads.
TEST(Marginalize, CeresTakesThePrior) {
  Random random(test::TestSeed(7), 0);
  Window window;
  FillWindow(true, &random, &window);
  for (WindowFactor& factor : window.factors) factor.loss = nullptr;
  const std::vector<WindowFactor> kept = WithPrior(window.factors, window.First(), &window);
  const auto poses = window.poses;
  const auto speeds = window.speeds;
  const auto landmarks = window.landmarks;
  const auto manifold = MakePoseManifold();
  std::vector<std::vector<double>> ends;
  for (const auto& factors : {window.factors, kept}) {
    window.poses = poses;
    window.speeds = speeds;
    window.landmarks = landmarks;
    ceres::Problem::Options problem_options;
    problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(problem_options);
    for (const WindowFactor& factor : factors) {
      problem.AddResidualBlock(const_cast<ceres::CostFunction*>(factor.cost), nullptr,
                               factor.blocks);
    }
    for (auto& pose : window.poses) {
      if (problem.HasParameterBlock(pose.data())) problem.SetManifold(pose.data(), manifold.get());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 1;
    options.initial_trust_region_radius = 1e16;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    ASSERT_LT(summary.final_cost, summary.initial_cost) << summary.FullReport();
    std::vector<double> end;
    for (size_t i = 1; i < window.poses.size(); ++i) {
      end.insert(end.end(), window.poses[i].begin(), window.poses[i].end());
      end.insert(end.end(), window.speeds[i].begin(), window.speeds[i].end());
    }
    ends.push_back(std::move(end));
  }
  for (size_t i = 0; i < ends[0].size(); ++i) EXPECT_NEAR(ends[0][i], ends[1][i], 1e-8) << i;
}

// Moving and turning everything about the vertical changes nothing that was measured.
MatrixXd FreeDirections(const LinearPrior& prior) {
  MatrixXd directions = MatrixXd::Zero(prior.jacobian.cols(), 4);
  Eigen::Index row = 0;
  for (size_t i = 0; i < prior.blocks.size(); ++i) {
    const double* block = prior.blocks[i];
    const int size = prior.sizes[i];
    const Vector3d vector(block);
    if (size == kSpeedBlockSize) {
      directions.block<3, 1>(row, 3) = Vector3d::UnitZ().cross(vector);
      row += 9;
      continue;
    }
    directions.block<3, 3>(row, 0).setIdentity();
    directions.block<3, 1>(row, 3) = Vector3d::UnitZ().cross(vector);
    if (size == kPoseBlockSize) {
      directions.block<3, 1>(row + 3, 3) =
          PoseOfBlock(block).orientation.conjugate() * Vector3d::UnitZ();
    }
    row += size == kPoseBlockSize ? 6 : 3;
  }
  return directions;
}

TEST(Marginalize, KeepsPositionAndYawFreeAndNothingElse) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(test::TestSeed(seed), 1);
    Window window;
    FillWindow(false, &random, &window);
    // Two states and their landmarks at once.
    std::vector<double*> dropped = window.First();
    dropped.push_back(window.poses[1].data());
    dropped.push_back(window.speeds[1].data());
    std::vector<WindowFactor> touching;
    for (const WindowFactor& factor : window.factors) {
      if (Touches(factor, dropped)) touching.push_back(factor);
    }
    const auto prior = Marginalize(touching, dropped, {});
    ASSERT_TRUE(prior.ok()) << prior.status();
    // In standard deviations of single numbers, so that metres and radians compare.
    const VectorXd scale = prior->jacobian.colwise().norm().transpose().cwiseInverse();
    const MatrixXd scaled = prior->jacobian * scale.asDiagonal();
    const MatrixXd directions = scale.cwiseInverse().asDiagonal() * FreeDirections(*prior);
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT((scaled * directions.col(i)).norm(), 1e-9 * directions.col(i).norm()) << i;
    }
    const VectorXd singular = scaled.jacobiSvd().singularValues();
    const Eigen::Index count = singular.size();
    EXPECT_GT(singular[count - 5], 1e-3 * singular[0]);
    EXPECT_LT(singular[count - 4], 1e-12 * singular[0]);
  }
}

TEST(Marginalize, LeavesWhatNobodySawWithoutInformation) {
  Random random(test::TestSeed(8), 0);
  Window window;
  FillWindow(true, &random, &window);
  // Only one state's pose, and a block of which nothing is known: its factor gives zeros.
  std::array<double, 9> unknown{};
  window.Add(std::make_unique<SpeedAnchor>(InertialState(), 3), {unknown.data()});
  std::vector<WindowFactor> factors = {window.factors.front(), window.factors.back()};
  const auto prior = Marginalize(factors, std::vector<double*>{unknown.data()}, {});
  ASSERT_TRUE(prior.ok()) << prior.status();
  ASSERT_EQ(prior->blocks, std::vector<double*>{window.poses[0].data()});
  const MatrixXd information = prior->jacobian.transpose() * prior->jacobian;
  const Dense alone = DenseOf({window.factors.front()});
  EXPECT_LT((information - alone.jacobian.transpose() * alone.jacobian).norm(),
            1e-9 * information.norm());
}

TEST(Marginalize, GivesHeldBlocksNoColumn) {
  Random random(test::TestSeed(9), 0);
  Window window;
  FillWindow(true, &random, &window);
  const std::vector<double*> held = {window.poses[2].data()};
  std::vector<WindowFactor> touching;
  for (const WindowFactor& factor : window.factors) {
    if (Touches(factor, window.First())) touching.push_back(factor);
  }
  const auto prior = Marginalize(touching, window.First(), held);
  ASSERT_TRUE(prior.ok()) << prior.status();
  EXPECT_FALSE(Touches({nullptr, nullptr, prior->blocks}, held));
  // Held is what a strong anchor would hold.
  window.Add(std::make_unique<PoseAnchor>(PoseOfBlock(held[0]), 1e-7, 1e-7), held);
  touching.push_back(window.factors.back());
  std::vector<double*> dropped = window.First();
  dropped.push_back(held[0]);
  const auto anchored = Marginalize(touching, dropped, {});
  ASSERT_TRUE(anchored.ok()) << anchored.status();
  ASSERT_EQ(anchored->blocks, prior->blocks);
  const MatrixXd expected = anchored->jacobian.transpose() * anchored->jacobian;
  const MatrixXd information = prior->jacobian.transpose() * prior->jacobian;
  EXPECT_LT((information - expected).norm(), 1e-5 * expected.norm());
}

TEST(Marginalize, RefusesFactorsThatAreNotFiniteOrDoNotFit) {
  Random random(test::TestSeed(10), 0);
  Window window;
  FillWindow(true, &random, &window);
  std::vector<WindowFactor> factors = window.factors;
  window.landmarks[0][0] = std::numeric_limits<double>::quiet_NaN();
  auto prior = Marginalize(factors, window.First(), {});
  EXPECT_EQ(ReasonOf(prior.status()), Reason::kFieldInvalid);
  EXPECT_NE(std::string(prior.status().message()).find("not finite"), std::string::npos)
      << prior.status();
  window.landmarks[0][0] = 0.0;
  factors[0].blocks.push_back(window.poses[1].data());
  prior = Marginalize(factors, window.First(), {});
  EXPECT_NE(std::string(prior.status().message()).find("factor 1 of"), std::string::npos)
      << prior.status();
  factors[0].blocks = {window.speeds[0].data()};
  EXPECT_EQ(ReasonOf(Marginalize(factors, window.First(), {}).status()), Reason::kFieldInvalid);
  factors = {window.factors[2]};
  factors[0].blocks[2] = factors[0].blocks[0];
  EXPECT_EQ(ReasonOf(Marginalize(factors, {}, {}).status()), Reason::kFieldInvalid);
}

TEST(PriorFactor, IsLinearInTheStepsOfItsBlocks) {
  Random random(test::TestSeed(11), 0);
  Window window;
  FillWindow(true, &random, &window);
  auto made = Marginalize(window.factors, window.First(), {});
  ASSERT_TRUE(made.ok()) << made.status();
  const LinearPrior prior = *made;
  const auto factor = MakePriorFactor(prior);
  VectorXd residual(prior.residual.size());
  ASSERT_TRUE(factor->Evaluate(prior.blocks.data(), residual.data(), nullptr));
  EXPECT_LT((residual - prior.residual).norm(), 1e-9 * prior.residual.norm());
  // Moved somewhere else.
  VectorXd step(prior.jacobian.cols());
  for (double& value : step) value = 0.1 * random.Uniform(-1.0, 1.0);
  Eigen::Index row = 0;
  for (size_t i = 0; i < prior.blocks.size(); ++i) {
    double* block = prior.blocks[i];
    if (prior.sizes[i] == kPoseBlockSize) {
      WritePoseBlock(Stepped(PoseOfBlock(block), step.segment<6>(row)), block);
      row += 6;
      continue;
    }
    for (int k = 0; k < prior.sizes[i]; ++k) block[k] += step[row++];
  }
  ASSERT_TRUE(factor->Evaluate(prior.blocks.data(), residual.data(), nullptr));
  const VectorXd expected = prior.residual + prior.jacobian * step;
  EXPECT_LT((residual - expected).norm(), 1e-9 * expected.norm());
  // The Jacobian stays that of the first estimate.
  const Dense dense = DenseOf({{factor.get(), nullptr, prior.blocks}});
  EXPECT_EQ(dense.jacobian, prior.jacobian);
}

}  // namespace
}  // namespace dsg::ingest
