// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/landmark_factor.h"

#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>

#include "ingest/solver/pose_block.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/window/swinging_rig.h"

namespace dsg::ingest {
namespace {

struct Blocks {
  std::array<double, kPoseBlockSize> anchor{};
  std::array<double, kPoseBlockSize> other{};
  LandmarkBlock landmark{};
  CalibrationError error{0.4, 0.02, 0.015};

  Eigen::VectorXd Residual(const ceres::CostFunction& cost) const {
    const double* blocks[] = {anchor.data(), other.data(), landmark.data(), error.data()};
    Eigen::VectorXd residual(cost.num_residuals());
    EXPECT_TRUE(cost.Evaluate(blocks, residual.data(), nullptr));
    return residual;
  }
};

Blocks BlocksAt(double from_s, double to_s, const LandmarkBlock& landmark) {
  Blocks blocks;
  WritePoseBlock(SwungPose(from_s), blocks.anchor.data());
  WritePoseBlock(SwungPose(to_s), blocks.other.data());
  blocks.landmark = landmark;
  return blocks;
}

const CameraMotion kMotion{{0.3, -0.7, 0.2}, {0.4, -0.1, 0.9}};

// Central differences of steps of the poses, of the landmark and of the calibration error.
Eigen::MatrixXd Differences(const ceres::CostFunction& cost, const Blocks& at) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd by_step(cost.num_residuals(), 18);
  for (int i = 0; i < 18; ++i) {
    Eigen::VectorXd ends[2];
    for (int side = 0; side < 2; ++side) {
      const double step = side == 0 ? -kStep : kStep;
      Blocks moved = at;
      Vector6d delta = Vector6d::Zero();
      if (i < 12) delta[i % 6] = step;
      if (i < 6) WritePoseBlock(Stepped(PoseOfBlock(at.anchor.data()), delta), moved.anchor.data());
      if (i >= 6 && i < 12) {
        WritePoseBlock(Stepped(PoseOfBlock(at.other.data()), delta), moved.other.data());
      }
      if (i >= 12 && i < 15) moved.landmark[static_cast<size_t>(i - 12)] += step;
      if (i >= 15) moved.error[static_cast<size_t>(i - 15)] += step;
      ends[side] = moved.Residual(cost);
    }
    by_step.col(i) = (ends[1] - ends[0]) / (2.0 * kStep);
  }
  return by_step;
}

void ExpectGradients(const LandmarkSight& sight) {
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto cost = MakeSightFactor(TestModel(), sight, {0.8, 1.3}, kMotion);
  for (const double inverse_depth : {0.0, 0.02, 0.3, 1.0}) {
    const Blocks at = BlocksAt(1.0, 1.7, {-0.13, -0.09, inverse_depth});
    const int rows = cost->num_residuals();
    RowMatrix by_anchor(rows, 7);
    RowMatrix by_other(rows, 7);
    RowMatrix by_landmark(rows, 3);
    RowMatrix by_error(rows, 3);
    Eigen::VectorXd residual(rows);
    const double* blocks[] = {at.anchor.data(), at.other.data(), at.landmark.data(),
                              at.error.data()};
    double* outputs[] = {by_anchor.data(), by_other.data(), by_landmark.data(), by_error.data()};
    ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), outputs));
    Eigen::MatrixXd analytic(rows, 18);
    analytic << by_anchor.leftCols<6>(), by_other.leftCols<6>(), by_landmark, by_error;
    const Eigen::MatrixXd numeric = Differences(*cost, at);
    const double scale = numeric.cwiseAbs().maxCoeff();
    EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff(), 1e-6 * scale) << inverse_depth;
    EXPECT_EQ(by_anchor.col(6).norm() + by_other.col(6).norm(), 0.0);
  }
}

TEST(SightFactor, DerivativesAreThoseOfDifferences) {
  ExpectGradients({{310.0, 190.0}, {}});
  ExpectGradients({{310.0, 190.0}, 12.0});
}

TEST(SightFactor, MissesNothingOfThePointThatBothSee) {
  const StereoModel model = TestModel();
  Random random(1, 0);
  const std::vector<Eigen::Vector3d> points = RoomPoints(200, &random);
  const auto first = SightsAt(model, SwungPose(1.0), points, 0.0, 0.0, &random);
  const auto second = SightsAt(model, SwungPose(1.6), points, 0.0, 0.0, &random);
  int count = 0;
  for (const FeatureSight& a : first) {
    for (const FeatureSight& b : second) {
      if (a.feature_id != b.feature_id || !a.sight.disparity_px.has_value()) continue;
      const Eigen::Vector3d ray = model.RayOf(a.sight.pixel);
      const double inverse_depth = InverseDepthOf(model, {}, *a.sight.disparity_px);
      const auto cost = MakeSightFactor(model, b.sight, {1.0, 1.0}, {});
      Blocks blocks = BlocksAt(1.0, 1.6, {ray.x(), ray.y(), inverse_depth});
      blocks.error = {};
      EXPECT_LT(blocks.Residual(*cost).norm(), 1e-6);
      ++count;
    }
  }
  EXPECT_GT(count, 10);
}

TEST(SightFactor, RefusesWhatIsBehindTheCamera) {
  const auto cost = MakeSightFactor(TestModel(), {{310.0, 190.0}, {}}, {1.0, 1.0}, {});
  Blocks blocks = BlocksAt(1.0, 1.0, {-0.13, -0.09, 1.0});
  Pose3d ahead = SwungPose(1.0);
  ahead.position += ahead.orientation * Eigen::Vector3d(3.0, 0.0, 0.0);
  WritePoseBlock(ahead, blocks.other.data());
  const double* pointers[] = {blocks.anchor.data(), blocks.other.data(), blocks.landmark.data(),
                              blocks.error.data()};
  Eigen::Vector2d residual;
  EXPECT_FALSE(cost->Evaluate(pointers, residual.data(), nullptr));
}

TEST(AnchorFactor, MissesNothingOfItsOwnSight) {
  const StereoModel model = TestModel();
  const LandmarkSight sight{{300.0, 200.0}, 10.0};
  const auto cost = MakeAnchorFactor(model, sight, {1.0, 2.0}, kMotion);
  const Eigen::Vector3d ray = model.RayOf(sight.pixel);
  const LandmarkBlock landmark{ray.x(), ray.y(), InverseDepthOf(model, {}, 10.0)};
  const CalibrationError right{};
  const double* blocks[] = {landmark.data(), right.data()};
  Eigen::Vector3d residual;
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> jacobian;
  double* outputs[] = {jacobian.data(), nullptr};
  ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), outputs));
  EXPECT_LT(residual.norm(), 1e-9);
  EXPECT_NEAR(jacobian(0, 0), model.fx, 1e-9);
  EXPECT_NEAR(jacobian(1, 1), model.fy, 1e-9);
  EXPECT_NEAR(jacobian(2, 2), 0.5 * DisparityOf(model, {}, 1.0), 1e-9);
}

TEST(AnchorFactor, DerivativesAreThoseOfDifferences) {
  const auto cost = MakeAnchorFactor(TestModel(), {{300.0, 200.0}, 10.0}, {0.8, 1.3}, kMotion);
  const std::array<double, 6> at = {-0.13, -0.09, 0.3, 0.4, 0.02, 0.015};
  const auto miss_at = [&](const std::array<double, 6>& numbers) {
    const double* blocks[] = {numbers.data(), numbers.data() + 3};
    Eigen::Vector3d residual;
    EXPECT_TRUE(cost->Evaluate(blocks, residual.data(), nullptr));
    return residual;
  };
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> by_landmark;
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> by_error;
  double* outputs[] = {by_landmark.data(), by_error.data()};
  const double* blocks[] = {at.data(), at.data() + 3};
  Eigen::Vector3d residual;
  ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), outputs));
  for (int i = 0; i < 6; ++i) {
    constexpr double kStep = 1e-6;
    std::array<double, 6> up = at;
    std::array<double, 6> down = at;
    up[static_cast<size_t>(i)] += kStep;
    down[static_cast<size_t>(i)] -= kStep;
    const Eigen::Vector3d numeric = (miss_at(up) - miss_at(down)) / (2.0 * kStep);
    const Eigen::Vector3d analytic = i < 3 ? by_landmark.col(i) : by_error.col(i - 3);
    EXPECT_LT((analytic - numeric).norm(), 1e-6 * std::max(1.0, numeric.norm())) << i;
  }
}

// A point that is seen a little later is where a camera that moves like that sees it then.
TEST(SightFactor, SeesThePointWhereItIsLater) {
  constexpr double kLateS = 0.01;
  const StereoModel model = TestModel();
  const Pose3d map_T_camera = SwungPose(1.0) * model.imu_T_camera;
  const Eigen::Vector3d point = map_T_camera * Eigen::Vector3d(0.4, -0.3, 3.0);
  Pose3d late = map_T_camera;
  late.position += map_T_camera.orientation * (kLateS * kMotion.speed_m_s);
  late.orientation = late.orientation * RotationOf(kLateS * kMotion.turn_rad_s);
  const Eigen::Vector3d seen = late.Inverse() * point;
  const LandmarkSight sight{
      {model.cx + model.fx * seen.x() / seen.z(), model.cy + model.fy * seen.y() / seen.z()},
      DisparityOf(model, {}, 1.0 / seen.z())};
  const LandmarkBlock landmark{0.4 / 3.0, -0.1, 1.0 / 3.0};
  const auto miss_of = [&](double late_s) {
    return SightErrorOf(model, SwungPose(1.0), SwungPose(1.0), sight, kMotion, landmark,
                        {0.0, 0.0, late_s})
        ->norm();
  };
  EXPECT_GT(miss_of(0.0), 2.0);
  EXPECT_LT(miss_of(kLateS), 0.05);
}

}  // namespace
}  // namespace dsg::ingest
