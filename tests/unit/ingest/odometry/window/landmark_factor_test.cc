// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/landmark_factor.h"

#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "ingest/solver/pose_block.h"
#include "tests/unit/ingest/odometry/window/swinging_rig.h"

namespace dsg::ingest {
namespace {

struct Blocks {
  std::array<double, kPoseBlockSize> anchor{};
  std::array<double, kPoseBlockSize> other{};
  LandmarkBlock landmark{};
  /// Of sights with a disparity only.
  StereoError stereo{0.4, 0.02};

  Eigen::VectorXd Residual(const ceres::CostFunction& cost) const {
    const double* blocks[] = {anchor.data(), other.data(), landmark.data(), stereo.data()};
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

// Central differences of steps of the poses, of the landmark and of the stereo error.
Eigen::MatrixXd Differences(const ceres::CostFunction& cost, const Blocks& at) {
  constexpr double kStep = 1e-6;
  const int count = cost.num_residuals() == 3 ? 17 : 15;
  Eigen::MatrixXd by_step(cost.num_residuals(), count);
  for (int i = 0; i < count; ++i) {
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
      if (i >= 15) moved.stereo[static_cast<size_t>(i - 15)] += step;
      ends[side] = moved.Residual(cost);
    }
    by_step.col(i) = (ends[1] - ends[0]) / (2.0 * kStep);
  }
  return by_step;
}

void ExpectGradients(const LandmarkSight& sight) {
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto cost = MakeSightFactor(TestModel(), sight, {0.8, 1.3});
  for (const double inverse_depth : {0.0, 0.02, 0.3, 1.0}) {
    const Blocks at = BlocksAt(1.0, 1.7, {-0.13, -0.09, inverse_depth});
    const int rows = cost->num_residuals();
    RowMatrix by_anchor(rows, 7);
    RowMatrix by_other(rows, 7);
    RowMatrix by_landmark(rows, 3);
    RowMatrix by_stereo(rows, 2);
    Eigen::VectorXd residual(rows);
    const double* blocks[] = {at.anchor.data(), at.other.data(), at.landmark.data(),
                              at.stereo.data()};
    double* outputs[] = {by_anchor.data(), by_other.data(), by_landmark.data(), by_stereo.data()};
    ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), outputs));
    Eigen::MatrixXd analytic(rows, rows == 3 ? 17 : 15);
    analytic.leftCols<15>() << by_anchor.leftCols<6>(), by_other.leftCols<6>(), by_landmark;
    if (rows == 3) analytic.rightCols<2>() = by_stereo;
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
      const auto cost = MakeSightFactor(model, b.sight, {1.0, 1.0});
      Blocks blocks = BlocksAt(1.0, 1.6, {ray.x(), ray.y(), inverse_depth});
      blocks.stereo = {};
      EXPECT_LT(blocks.Residual(*cost).norm(), 1e-6);
      ++count;
    }
  }
  EXPECT_GT(count, 10);
}

TEST(SightFactor, RefusesWhatIsBehindTheCamera) {
  const auto cost = MakeSightFactor(TestModel(), {{310.0, 190.0}, {}}, {1.0, 1.0});
  Blocks blocks = BlocksAt(1.0, 1.0, {-0.13, -0.09, 1.0});
  Pose3d ahead = SwungPose(1.0);
  ahead.position += ahead.orientation * Eigen::Vector3d(3.0, 0.0, 0.0);
  WritePoseBlock(ahead, blocks.other.data());
  const double* pointers[] = {blocks.anchor.data(), blocks.other.data(), blocks.landmark.data()};
  Eigen::Vector2d residual;
  EXPECT_FALSE(cost->Evaluate(pointers, residual.data(), nullptr));
}

TEST(AnchorFactor, MissesNothingOfItsOwnSight) {
  const StereoModel model = TestModel();
  const LandmarkSight sight{{300.0, 200.0}, 10.0};
  const auto cost = MakeAnchorFactor(model, sight, {1.0, 2.0});
  const Eigen::Vector3d ray = model.RayOf(sight.pixel);
  const LandmarkBlock landmark{ray.x(), ray.y(), InverseDepthOf(model, {}, 10.0)};
  const StereoError right{};
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

}  // namespace
}  // namespace dsg::ingest
