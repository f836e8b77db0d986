// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/inertial_factor.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"
#include "tests/unit/ingest/odometry/inertial/window_factors.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

const Vector3d kGravity(0.0, 0.0, -9.81);

Preintegration SwungHalfSecond(const ImuBias& bias) {
  auto result =
      Preintegration::Make(SwungSamples(0.5, 200.0), 0, 500'000'000, bias, Adis16448(), {});
  EXPECT_TRUE(result.ok()) << result.status();
  return *std::move(result);
}

TEST(InertialState, StepsAndBlocksKeepAllNumbers) {
  Random random(test::TestSeed(1), 0);
  const InertialState state = AnyState(&random);
  const Vector15d step = RandomStep15(1.0, &random);
  EXPECT_LT((StepBetween(state, Stepped(state, step)) - step).norm(), 1e-13);
  EXPECT_LT(StepBetween(state, StateBlocks(state).state()).norm(), 1e-15);
  const StateBlocks blocks(state);
  EXPECT_EQ(blocks.speed[1], state.velocity_map.y());
  EXPECT_EQ(blocks.speed[3], state.bias.gyro_rad_s.x());
  EXPECT_EQ(blocks.speed[8], state.bias.accel_m_s2.z());
}

TEST(InertialResidual, IsZeroWhereTheUnitWent) {
  Random random(test::TestSeed(2), 0);
  const Preintegration measured = SwungHalfSecond({});
  for (int round = 0; round < 20; ++round) {
    const InertialState from = AnyState(&random);
    const InertialState to = measured.Predict(from, kGravity, nullptr);
    EXPECT_LT(InertialResidual(measured, from, to, kGravity, nullptr, nullptr).norm(), 1e-12);
  }
}

// States that fit, and states a metre and a radian apart.
TEST(InertialResidual, DerivativesAgreeWithDifferences) {
  Random random(test::TestSeed(3), 0);
  for (int round = 0; round < 100; ++round) {
    const InertialState from = AnyState(&random);
    ImuBias bias = from.bias;
    bias.gyro_rad_s += NormalVector(0.02, &random);
    bias.accel_m_s2 += NormalVector(0.1, &random);
    const Preintegration measured = SwungHalfSecond(bias);
    const double distance = round % 2 == 0 ? 0.01 : 1.0;
    const InertialState to =
        Stepped(measured.Predict(from, kGravity, nullptr), RandomStep15(distance, &random));
    Matrix15d by_from;
    Matrix15d by_to;
    const Vector15d residual = InertialResidual(measured, from, to, kGravity, &by_from, &by_to);
    EXPECT_EQ(residual, InertialResidual(measured, from, to, kGravity, nullptr, nullptr));
    for (int i = 0; i < 15; ++i) {
      const double size = 1e-6;
      const Vector15d step = size * Vector15d::Unit(i);
      const auto at = [&](const InertialState& a, const InertialState& b) {
        return InertialResidual(measured, a, b, kGravity, nullptr, nullptr);
      };
      const Vector15d from_change =
          (at(Stepped(from, step), to) - at(Stepped(from, -step), to)) / (2.0 * size);
      const Vector15d to_change =
          (at(from, Stepped(to, step)) - at(from, Stepped(to, -step))) / (2.0 * size);
      EXPECT_LT((by_from.col(i) - from_change).norm(), 1e-7) << round << " column " << i;
      EXPECT_LT((by_to.col(i) - to_change).norm(), 1e-7) << round << " column " << i;
    }
  }
}

// As Ceres calls it: whitened, by blocks, through the manifold.
TEST(InertialFactor, JacobiansAgreeWithDifferences) {
  Random random(test::TestSeed(4), 0);
  const Preintegration measured = SwungHalfSecond({});
  const auto factor = MakeInertialFactor(&measured, kGravity);
  ASSERT_EQ(factor->num_residuals(), 15);
  ASSERT_EQ(factor->parameter_block_sizes(), (std::vector<int32_t>{7, 9, 7, 9}));
  const auto manifold = MakePoseManifold();
  for (int round = 0; round < 20; ++round) {
    const InertialState from = AnyState(&random);
    const InertialState to =
        Stepped(measured.Predict(from, kGravity, nullptr), RandomStep15(0.1, &random));
    const std::array<StateBlocks, 2> blocks = {StateBlocks(from), StateBlocks(to)};
    const std::array<const double*, 4> inputs = {blocks[0].pose.data(), blocks[0].speed.data(),
                                                 blocks[1].pose.data(), blocks[1].speed.data()};
    std::array<Eigen::Matrix<double, 15, 7, Eigen::RowMajor>, 2> by_pose;
    std::array<Eigen::Matrix<double, 15, 9, Eigen::RowMajor>, 2> by_speed;
    std::array<double*, 4> outputs = {by_pose[0].data(), by_speed[0].data(), by_pose[1].data(),
                                      by_speed[1].data()};
    Vector15d residual;
    ASSERT_TRUE(factor->Evaluate(inputs.data(), residual.data(), outputs.data()));
    Vector15d alone;
    ASSERT_TRUE(factor->Evaluate(inputs.data(), alone.data(), nullptr));
    EXPECT_EQ(residual, alone);
    const Vector15d expected =
        measured.whitening() * InertialResidual(measured, from, to, kGravity, nullptr, nullptr);
    EXPECT_LT((residual - expected).norm(), 1e-12 * expected.norm());
    for (int block = 0; block < 4; ++block) {
      const bool is_pose = block % 2 == 0;
      const auto state = static_cast<size_t>(block / 2);
      for (int i = 0; i < (is_pose ? 6 : 9); ++i) {
        const double size = 1e-6;
        const auto at = [&](double step) {
          std::array<double, 9> moved{};
          if (is_pose) {
            const Vector6d delta = step * Vector6d::Unit(i);
            EXPECT_TRUE(manifold->Plus(inputs[block], delta.data(), moved.data()));
          } else {
            std::copy_n(inputs[block], 9, moved.data());
            moved[static_cast<size_t>(i)] += step;
          }
          std::array<const double*, 4> changed = inputs;
          changed[static_cast<size_t>(block)] = moved.data();
          Vector15d result;
          EXPECT_TRUE(factor->Evaluate(changed.data(), result.data(), nullptr));
          return result;
        };
        const Vector15d change = (at(size) - at(-size)) / (2.0 * size);
        const Vector15d column =
            is_pose ? Vector15d(by_pose[state].col(i)) : Vector15d(by_speed[state].col(i));
        EXPECT_LT((column - change).norm(), 1e-6 * column.norm()) << block << " column " << i;
      }
      if (is_pose) {
        EXPECT_EQ(by_pose[state].col(6).norm(), 0.0);
      }
    }
  }
}

TEST(InertialFactor, LeavesOutWhatIsNotAskedFor) {
  Random random(test::TestSeed(5), 0);
  const Preintegration measured = SwungHalfSecond({});
  const auto factor = MakeInertialFactor(&measured, kGravity);
  const StateBlocks from(AnyState(&random));
  const StateBlocks to(AnyState(&random));
  const std::array<const double*, 4> inputs = {from.pose.data(), from.speed.data(), to.pose.data(),
                                               to.speed.data()};
  Eigen::Matrix<double, 15, 9, Eigen::RowMajor> by_speed;
  std::array<double*, 4> outputs = {nullptr, nullptr, nullptr, by_speed.data()};
  Vector15d residual;
  ASSERT_TRUE(factor->Evaluate(inputs.data(), residual.data(), outputs.data()));
  EXPECT_TRUE(by_speed.allFinite());
}

TEST(InertialFactor, FollowsANewIntegration) {
  Random random(test::TestSeed(6), 0);
  Preintegration measured = SwungHalfSecond({});
  const auto factor = MakeInertialFactor(&measured, kGravity);
  InertialState from = AnyState(&random);
  from.bias = {Vector3d(0.05, -0.04, 0.03), Vector3d(0.3, 0.2, -0.3)};
  ASSERT_TRUE(measured.Reintegrate(from.bias).ok());
  const StateBlocks a(from);
  const StateBlocks b(measured.Predict(from, kGravity, nullptr));
  const std::array<const double*, 4> inputs = {a.pose.data(), a.speed.data(), b.pose.data(),
                                               b.speed.data()};
  Vector15d residual;
  ASSERT_TRUE(factor->Evaluate(inputs.data(), residual.data(), nullptr));
  EXPECT_LT(residual.norm(), 1e-5);
}

// A known path gives velocities and biases back: what the odometry solves, with poses from
// elsewhere.
TEST(InertialFactor, FindsVelocitiesAndBiasesOfAKnownPath) {
  Random random(test::TestSeed(7), 0);
  const ImuBias bias{Vector3d(0.02, -0.03, 0.01), Vector3d(0.15, -0.1, 0.2)};
  auto samples = SwungSamples(4.0, 200.0);
  const int state_count = 9;
  std::vector<InertialState> truth = {AnyState(&random)};
  truth[0].bias = bias;
  std::vector<Preintegration> measured;
  for (ImuMeasurement& sample : samples) {
    sample.angular_velocity_rad_s += bias.gyro_rad_s;
    sample.acceleration_m_s2 += bias.accel_m_s2;
  }
  for (int i = 1; i < state_count; ++i) {
    const TimeNs from_ns = (i - 1) * TimeNs{500'000'000};
    auto part =
        Preintegration::Make(samples, from_ns, from_ns + 500'000'000, bias, Adis16448(), {});
    ASSERT_TRUE(part.ok()) << part.status();
    truth.push_back(part->Predict(truth.back(), kGravity, nullptr));
    // The solver begins without any idea of the biases.
    ASSERT_TRUE(part->Reintegrate({}).ok());
    measured.push_back(*std::move(part));
  }
  std::vector<StateBlocks> blocks;
  for (const InertialState& state : truth) {
    InertialState start = state;
    start.velocity_map = Vector3d::Zero();
    start.bias = ImuBias();
    blocks.emplace_back(start);
  }
  for (int round = 0; round < 3; ++round) {
    ceres::Problem problem;
    for (size_t i = 0; i < measured.size(); ++i) {
      problem.AddResidualBlock(MakeInertialFactor(&measured[i], kGravity).release(), nullptr,
                               blocks[i].pose.data(), blocks[i].speed.data(),
                               blocks[i + 1].pose.data(), blocks[i + 1].speed.data());
    }
    for (StateBlocks& state : blocks) problem.SetParameterBlockConstant(state.pose.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 1e-15;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    ASSERT_TRUE(summary.IsSolutionUsable()) << summary.message;
    for (size_t i = 0; i < measured.size(); ++i) {
      const ImuBias found = blocks[i].state().bias;
      EXPECT_EQ(measured[i].IsFarFrom(found), round == 0) << round;
      ASSERT_TRUE(measured[i].Reintegrate(found).ok());
    }
  }
  for (size_t i = 0; i < truth.size(); ++i) {
    const Vector15d error = StepBetween(truth[i], blocks[i].state());
    EXPECT_LT(error.segment<3>(kVelocityRow).norm(), 1e-4) << i;
    EXPECT_LT(error.segment<3>(kGyroBiasRow).norm(), 1e-5) << i;
    EXPECT_LT(error.segment<3>(kAccelBiasRow).norm(), 1e-3) << i;
  }
}

}  // namespace
}  // namespace dsg::ingest
