// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/factor_covariance.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <memory>
#include <vector>

#include "ingest/odometry/inertial/marginalization.h"
#include "ingest/solver/pose_block.h"
#include "tests/unit/ingest/odometry/window/swinging_rig.h"

namespace dsg::ingest {
namespace {

// Two images of some points, and a prior on the first one and on the calibration.
class TwoImages {
 public:
  TwoImages() {
    WritePoseBlock(SwungPose(1.0), from_.data());
    WritePoseBlock(SwungPose(1.6), to_.data());
    Add(MakePriorFactor(FirstPrior()), {from_.data(), error_.data()});
    const StereoModel model = TestModel();
    Random random(4, 0);
    const std::vector<Eigen::Vector3d> points = RoomPoints(150, &random);
    const auto first = SightsAt(model, SwungPose(1.0), points, 0.5, 0.5, &random);
    const auto second = SightsAt(model, SwungPose(1.6), points, 0.5, 0.5, &random);
    for (const FeatureSight& a : first) {
      for (const FeatureSight& b : second) {
        if (a.feature_id == b.feature_id) AddPoint(a.sight, b.sight);
      }
    }
  }

  const std::vector<WindowFactor>& factors() const { return factors_; }
  const std::vector<double*>& landmarks() const { return pointers_; }
  double* to() { return to_.data(); }
  double* error() { return error_.data(); }

  // By Ceres, from all columns at once.
  Eigen::MatrixXd OfCeres() {
    const std::unique_ptr<ceres::Manifold> manifold = MakePoseManifold();
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    problem.AddParameterBlock(from_.data(), kPoseBlockSize, manifold.get());
    problem.AddParameterBlock(to_.data(), kPoseBlockSize, manifold.get());
    for (const WindowFactor& factor : factors_) {
      problem.AddResidualBlock(const_cast<ceres::CostFunction*>(factor.cost), nullptr,
                               factor.blocks);
    }
    ceres::Covariance::Options how;
    how.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(how);
    const std::vector<const double*> wanted = {to_.data(), error_.data()};
    EXPECT_TRUE(covariance.Compute(wanted, &problem));
    Eigen::Matrix<double, 9, 9, Eigen::RowMajor> all;
    EXPECT_TRUE(covariance.GetCovarianceMatrixInTangentSpace(wanted, all.data()));
    return all;
  }

 private:
  LinearPrior FirstPrior() {
    LinearPrior prior;
    prior.blocks = {from_.data(), error_.data()};
    prior.sizes = {kPoseBlockSize, kCalibrationErrorSize};
    prior.point.assign(from_.begin(), from_.end());
    prior.point.insert(prior.point.end(), error_.begin(), error_.end());
    Eigen::Matrix<double, 9, 1> sigma;
    sigma << 0.01, 0.02, 0.01, 0.003, 0.002, 0.004, 1.0, 0.002, 0.005;
    prior.jacobian = sigma.cwiseInverse().asDiagonal();
    prior.residual = Eigen::VectorXd::Zero(9);
    return prior;
  }

  void AddPoint(const LandmarkSight& first, const LandmarkSight& second) {
    const StereoModel model = TestModel();
    const Eigen::Vector3d ray = model.RayOf(first.pixel);
    const double disparity_px = first.disparity_px.value_or(6.0);
    landmarks_.push_back({ray.x(), ray.y(), InverseDepthOf(model, {}, disparity_px)});
    double* const landmark = landmarks_.back().data();
    pointers_.push_back(landmark);
    const SightNoise noise{0.7, 0.9};
    Add(MakeAnchorFactor(model, first, noise, {}), {landmark, error_.data()});
    Add(MakeSightFactor(model, second, noise, {{0.1, -0.4, 0.2}, {0.5, 0.1, 0.3}}),
        {from_.data(), to_.data(), landmark, error_.data()});
  }

  void Add(std::unique_ptr<ceres::CostFunction> cost, std::vector<double*> blocks) {
    factors_.push_back({cost.get(), nullptr, std::move(blocks)});
    owned_.push_back(std::move(cost));
  }

  std::array<double, kPoseBlockSize> from_{};
  std::array<double, kPoseBlockSize> to_{};
  CalibrationError error_{};
  std::deque<LandmarkBlock> landmarks_;
  std::vector<double*> pointers_;
  std::vector<std::unique_ptr<ceres::CostFunction>> owned_;
  std::vector<WindowFactor> factors_;
};

TEST(CovarianceOf, IsThatOfCeres) {
  TwoImages images;
  ASSERT_GT(images.landmarks().size(), 10u);
  double* const wanted[] = {images.to(), images.error()};
  const auto covariance = CovarianceOf(images.factors(), images.landmarks(), wanted);
  ASSERT_TRUE(covariance.ok()) << covariance.status();
  const Eigen::MatrixXd expected = images.OfCeres();
  const Eigen::VectorXd per_sigma = expected.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd miss =
      per_sigma.asDiagonal() * (*covariance - expected) * per_sigma.asDiagonal();
  EXPECT_LT(miss.cwiseAbs().maxCoeff(), 1e-6);
}

TEST(CovarianceOf, RefusesWhatTheFactorsDoNotDetermine) {
  TwoImages images;
  double other[3] = {};
  double* const unknown[] = {other};
  EXPECT_EQ(CovarianceOf(images.factors(), images.landmarks(), unknown).status().code(),
            absl::StatusCode::kInvalidArgument);
  double* const wanted[] = {images.to()};
  EXPECT_FALSE(CovarianceOf({images.factors().data(), 1}, {}, wanted).ok());
}

}  // namespace
}  // namespace dsg::ingest
