// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/temp_folder.h"

namespace dsg::evaluation {
namespace {

constexpr TimeNs kStep = 50'000'000;

// A figure of eight with some height, about 30 m long.
std::vector<StampedPose> Path(int count = 600) {
  std::vector<StampedPose> path;
  for (int i = 0; i < count; ++i) {
    const double t = 0.02 * i;
    StampedPose pose;
    pose.time_ns = i * kStep;
    pose.map_T_body.position = {4.0 * std::sin(t), 2.0 * std::sin(2.0 * t),
                                1.0 + 0.1 * std::cos(3 * t)};
    pose.map_T_body.orientation = Eigen::AngleAxisd(0.7 * t, Eigen::Vector3d::UnitZ());
    path.push_back(pose);
  }
  return path;
}

std::vector<StampedPose> Moved(std::vector<StampedPose> path, const Pose3d& map_T_other) {
  for (StampedPose& pose : path) pose.map_T_body = map_T_other * pose.map_T_body;
  return path;
}

double Ate(const std::vector<StampedPose>& estimate, Alignment alignment) {
  return AbsoluteError(AssociatePoses(estimate, Path()), alignment)->rmse_m;
}

TEST(TrajectoryMetric, IsZeroForThePathItself) {
  for (const Alignment alignment : {Alignment::kNone, Alignment::kYaw, Alignment::kSe3}) {
    EXPECT_LT(Ate(Path(), alignment), 1e-9);
  }
  const auto rpe = RelativeError(AssociatePoses(Path(), Path()), 5.0);
  ASSERT_TRUE(rpe.has_value());
  EXPECT_LT(rpe->translation_percent, 1e-9);
  EXPECT_LT(rpe->rotation_deg_per_m, 1e-5);
  EXPECT_DOUBLE_EQ(Coverage(Path(), 0, 599 * kStep), 1.0);
}

TEST(TrajectoryMetric, AlignmentForgivesExactlyItsDegreesOfFreedom) {
  const Pose3d yawed{{3, -2, 1},
                     Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()))};
  EXPECT_LT(Ate(Moved(Path(), yawed), Alignment::kYaw), 1e-9);
  EXPECT_LT(Ate(Moved(Path(), yawed), Alignment::kSe3), 1e-9);
  EXPECT_GT(Ate(Moved(Path(), yawed), Alignment::kNone), 2.0);
  const Pose3d tilted{{0, 0, 0},
                      Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()))};
  EXPECT_LT(Ate(Moved(Path(), tilted), Alignment::kSe3), 1e-9);
  EXPECT_GT(Ate(Moved(Path(), tilted), Alignment::kYaw), 0.1);
}

TEST(TrajectoryMetric, ForgivesNeitherScaleNorMirror) {
  std::vector<StampedPose> scaled = Path();
  std::vector<StampedPose> mirrored = Path();
  for (size_t i = 0; i < scaled.size(); ++i) {
    scaled[i].map_T_body.position *= 1.1;
    mirrored[i].map_T_body.position.x() *= -1.0;
    // A rotation about y would undo a flat mirror.
    mirrored[i].map_T_body.position.z() +=
        0.5 * mirrored[i].map_T_body.position.x() * mirrored[i].map_T_body.position.y();
  }
  EXPECT_GT(Ate(scaled, Alignment::kSe3), 0.1);
  EXPECT_GT(Ate(mirrored, Alignment::kSe3), 0.5);
}

TEST(TrajectoryMetric, MeasuresAKnownError) {
  // Half of the poses 1 m too high, half 1 m too low, interleaved: no alignment helps.
  std::vector<StampedPose> estimate = Path();
  for (size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].map_T_body.position.z() += i % 2 == 0 ? 1.0 : -1.0;
  }
  const auto ate = AbsoluteError(AssociatePoses(estimate, Path()), Alignment::kYaw);
  EXPECT_NEAR(ate->rmse_m, 1.0, 1e-6);
  EXPECT_NEAR(ate->median_m, 1.0, 1e-6);
  EXPECT_NEAR(ate->max_m, 1.0, 1e-6);
}

TEST(TrajectoryMetric, MeasuresDriftPerMetre) {
  std::vector<StampedPose> truth;
  std::vector<StampedPose> estimate;
  for (int i = 0; i < 500; ++i) {
    const double along = 0.05 * i;
    truth.push_back({i * kStep, {{along, 0, 0}, Eigen::Quaterniond::Identity()}});
    estimate.push_back({i * kStep, {{1.02 * along, 0, 0}, Eigen::Quaterniond::Identity()}});
  }
  const auto rpe = RelativeError(AssociatePoses(estimate, truth), 10.0);
  EXPECT_NEAR(rpe->translation_percent, 2.0, 0.02);
  EXPECT_LT(rpe->rotation_deg_per_m, 1e-6);
  EXPECT_FALSE(RelativeError(AssociatePoses(estimate, truth), 30.0).has_value());
}

TEST(TrajectoryMetric, InterpolatesTheTruthAndRejectsItsGaps) {
  std::vector<StampedPose> truth = {{0, {{0, 0, 0}, Eigen::Quaterniond::Identity()}},
                                    {100'000'000, {{1, 0, 0}, Eigen::Quaterniond::Identity()}},
                                    {300'000'000, {{3, 0, 0}, Eigen::Quaterniond::Identity()}}};
  const std::vector<StampedPose> estimate = {{-1, {}},          {25'000'000, {}},
                                             {100'000'000, {}}, {200'000'000, {}},
                                             {300'000'000, {}}, {300'000'001, {}}};
  const auto pairs = AssociatePoses(estimate, truth);
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_DOUBLE_EQ(pairs[0].truth.position.x(), 0.25);
  EXPECT_DOUBLE_EQ(pairs[1].truth.position.x(), 1.0);
  EXPECT_DOUBLE_EQ(pairs[2].truth.position.x(), 3.0);
}

TEST(TrajectoryMetric, ShowsThatHalfOfTheLogIsMissing) {
  std::vector<StampedPose> half = Path();
  half.resize(300);
  EXPECT_NEAR(Coverage(half, 0, 599 * kStep), 0.5, 0.01);
  EXPECT_NEAR(Coverage({{0, {}}}, 0, 10 * kNsPerSecond), 0.01, 1e-9);
  EXPECT_EQ(Coverage({}, 0, 1), 0.0);
}

TEST(TrajectoryMetric, SaysNothingAboutTwoPoses) {
  std::vector<StampedPose> two = Path();
  two.resize(2);
  EXPECT_FALSE(AbsoluteError(AssociatePoses(two, Path()), Alignment::kSe3).has_value());
}

TEST(TrajectoryMetric, IsNeverWorseBySe3ThanByYaw) {
  std::mt19937_64 random(test::TestSeed(3));
  for (int round = 0; round < 20; ++round) {
    std::vector<StampedPose> noisy = Path();
    for (StampedPose& pose : noisy) {
      for (int axis = 0; axis < 3; ++axis) {
        pose.map_T_body.position[axis] += static_cast<double>(random() % 1000) / 1000.0;
      }
    }
    EXPECT_LE(Ate(noisy, Alignment::kSe3), Ate(noisy, Alignment::kYaw) + 1e-9);
    EXPECT_LE(Ate(noisy, Alignment::kYaw), Ate(noisy, Alignment::kNone) + 1e-9);
  }
}

// Errors of up to a metre and 0.1 rad, the same for a seed.
std::vector<StampedPose> Noisy(std::vector<StampedPose> path, uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&random] { return static_cast<double>(random() % 2001) / 1000.0 - 1.0; };
  for (StampedPose& pose : path) {
    pose.map_T_body.position += Eigen::Vector3d(draw(), draw(), draw());
    pose.map_T_body.orientation =
        (pose.map_T_body.orientation *
         Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * draw(), Eigen::Vector3d::UnitY())))
            .normalized();
  }
  return path;
}

Pose3d SomeMotion() {
  return {{30, -20, 5},
          Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()))};
}

TEST(TrajectoryMetric, DoesNotCareWhereTheEstimatesMapLies) {
  const auto here = AssociatePoses(Noisy(Path(), 5), Path());
  const auto there = AssociatePoses(Moved(Noisy(Path(), 5), SomeMotion()), Path());
  const auto ate = AbsoluteError(here, Alignment::kSe3);
  const auto moved_ate = AbsoluteError(there, Alignment::kSe3);
  EXPECT_GT(ate->rmse_m, 0.5);
  EXPECT_NEAR(ate->rmse_m, moved_ate->rmse_m, 1e-9);
  EXPECT_NEAR(ate->median_m, moved_ate->median_m, 1e-9);
  EXPECT_NEAR(ate->max_m, moved_ate->max_m, 1e-9);
  EXPECT_NEAR(RelativeError(here, 5.0)->translation_percent,
              RelativeError(there, 5.0)->translation_percent, 1e-9);
  EXPECT_NEAR(RelativeError(here, 5.0)->rotation_deg_per_m,
              RelativeError(there, 5.0)->rotation_deg_per_m, 1e-9);
  EXPECT_NEAR(RelativeErrorOverTime(here, kNsPerSecond)->rmse_m,
              RelativeErrorOverTime(there, kNsPerSecond)->rmse_m, 1e-9);
}

TEST(TrajectoryMetric, FindsTheScaleOfASingleCamera) {
  std::vector<StampedPose> scaled = Moved(Path(), SomeMotion());
  for (StampedPose& pose : scaled) pose.map_T_body.position *= 0.4;
  const auto pairs = AssociatePoses(scaled, Path());
  EXPECT_GT(AbsoluteError(pairs, Alignment::kSe3)->rmse_m, 1.0);
  EXPECT_LT(AbsoluteError(pairs, Alignment::kSim3)->rmse_m, 1e-9);
  const Similarity truth_T_estimate = TruthFromEstimate(pairs, Alignment::kSim3);
  EXPECT_NEAR(truth_T_estimate.scale, 2.5, 1e-9);
  EXPECT_GT(RelativeError(pairs, 5.0)->translation_percent, 30.0);
  EXPECT_LT(RelativeError(Aligned(truth_T_estimate, pairs), 5.0)->translation_percent, 1e-9);
}

TEST(TrajectoryMetric, IsNeverWorseWithAScaleThanWithout) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const auto estimate = Noisy(Path(), seed);
    EXPECT_LE(Ate(estimate, Alignment::kSim3), Ate(estimate, Alignment::kSe3) + 1e-12);
  }
}

TEST(TrajectoryMetric, AScaleOfPosesInOnePointIsOne) {
  std::vector<StampedPose> still = Path();
  for (StampedPose& pose : still) pose.map_T_body.position = {1, 2, 3};
  const auto pairs = AssociatePoses(still, Path());
  EXPECT_EQ(TruthFromEstimate(pairs, Alignment::kSim3).scale, 1.0);
  EXPECT_TRUE(std::isfinite(AbsoluteError(pairs, Alignment::kSim3)->rmse_m));
}

TEST(TrajectoryMetric, TakesTheMedianOfAnEvenCountBetweenTheMiddleTwo) {
  std::vector<PosePair> pairs(4);
  for (int i = 0; i < 4; ++i) pairs[i].estimate.position.x() = i * i;
  EXPECT_DOUBLE_EQ(AbsoluteError(pairs, Alignment::kNone)->median_m, 2.5);
  pairs.pop_back();
  EXPECT_DOUBLE_EQ(AbsoluteError(pairs, Alignment::kNone)->median_m, 1.0);
}

// A metre a second straight on, with a tenth of a second between poses.
std::vector<StampedPose> Straight(double scale, double turn_per_s) {
  std::vector<StampedPose> path;
  for (int i = 0; i <= 100; ++i) {
    const Eigen::AngleAxisd turn(0.1 * i * turn_per_s, Eigen::Vector3d::UnitX());
    path.push_back({i * 2 * kStep, {{0.1 * i * scale, 0, 0}, Eigen::Quaterniond(turn)}});
  }
  return path;
}

TEST(TrajectoryMetric, MeasuresDriftPerSecond) {
  const auto pairs = AssociatePoses(Straight(1.02, 0.01), Straight(1.0, 0.0));
  const auto second = RelativeErrorOverTime(pairs, kNsPerSecond);
  EXPECT_NEAR(second->rmse_m, 0.02, 1e-9);
  EXPECT_NEAR(second->rmse_deg, 0.01 * kDegreesPerRadian, 1e-9);
  EXPECT_EQ(second->segment_count, 91);
  EXPECT_NEAR(RelativeErrorOverTime(pairs, 5 * kNsPerSecond)->rmse_m, 0.1, 1e-9);
  EXPECT_FALSE(RelativeErrorOverTime(pairs, 11 * kNsPerSecond).has_value());
}

TEST(TrajectoryMetric, LeavesOutStretchesThatAreMuchTooLong) {
  auto estimate = Straight(1.02, 0.0);
  estimate.erase(estimate.begin() + 40, estimate.begin() + 60);
  const auto pairs = AssociatePoses(estimate, Straight(1.0, 0.0));
  // From poses 30 to 39 the first one a second later is pose 60.
  EXPECT_EQ(RelativeErrorOverTime(pairs, kNsPerSecond)->segment_count, 30 + 31);
  EXPECT_NEAR(RelativeErrorOverTime(pairs, kNsPerSecond)->rmse_m, 0.02, 1e-9);
  EXPECT_EQ(RelativeErrorOverTime(pairs, kNsPerSecond, 3 * kNsPerSecond)->segment_count,
            30 + 10 + 31);
}

TEST(TrajectoryMetric, TakesTheNearestTruthIfAskedTo) {
  const std::vector<StampedPose> truth = {{0, {{1, 0, 0}, Eigen::Quaterniond::Identity()}},
                                          {100, {{2, 0, 0}, Eigen::Quaterniond::Identity()}},
                                          {1000, {{3, 0, 0}, Eigen::Quaterniond::Identity()}}};
  const std::vector<StampedPose> estimate = {{-21, {}}, {-20, {}},  {49, {}},   {50, {}},
                                             {51, {}},  {120, {}},  {121, {}},  {979, {}},
                                             {980, {}}, {1000, {}}, {1020, {}}, {1021, {}}};
  std::vector<std::pair<TimeNs, double>> found;
  for (const PosePair& pair : AssociatePoses(estimate, truth, 20, Association::kNearest)) {
    found.emplace_back(pair.time_ns, pair.truth.position.x());
  }
  EXPECT_EQ(found, (std::vector<std::pair<TimeNs, double>>{
                       {-20, 1}, {120, 2}, {980, 3}, {1000, 3}, {1020, 3}}));
  found.clear();
  for (const PosePair& pair : AssociatePoses(estimate, truth, 50, Association::kNearest)) {
    if (pair.time_ns > 0 && pair.time_ns < 100) {
      found.emplace_back(pair.time_ns, pair.truth.position.x());
    }
  }
  EXPECT_EQ(found, (std::vector<std::pair<TimeNs, double>>{{49, 1}, {50, 1}, {51, 2}}));
}

TEST(TrajectoryMetric, ComparesRowByRowWhateverTheStamps) {
  std::vector<StampedPose> estimate = Noisy(Path(), 2);
  for (StampedPose& pose : estimate) pose.time_ns = 7;
  const auto pairs = AssociateRows(estimate, Path());
  ASSERT_EQ(pairs.size(), 600u);
  EXPECT_EQ(AbsoluteError(pairs, Alignment::kSe3)->rmse_m, Ate(Noisy(Path(), 2), Alignment::kSe3));
}

std::shared_ptr<const Covariance6> DiagonalCovariance(
    const Eigen::Matrix<double, 6, 1>& variances) {
  Covariance6 upper{};
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    upper[next] = static_cast<float>(variances[row]);
    next += static_cast<size_t>(6 - row);
  }
  return std::make_shared<const Covariance6>(upper);
}

TEST(TrajectoryMetric, NeesIsTheSquareOfTheErrorInUnitsOfItsDeviation) {
  std::vector<PosePair> pairs(2);
  pairs[1].truth.position = {1, 0, 0};
  pairs[1].estimate.position = {1.3, 0.2, 0};
  pairs[1].estimate.orientation = Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitZ());
  Eigen::Matrix<double, 6, 1> variances;
  variances << 0.0625, 0.25, 1, 1, 1, 0.0009765625;
  pairs[1].covariance = DiagonalCovariance(variances);
  const auto nees = Nees(pairs);
  ASSERT_TRUE(nees.has_value());
  EXPECT_EQ(nees->pose_count, 1);
  EXPECT_NEAR(nees->position_mean, 0.09 / 0.0625 + 0.04 / 0.25, 1e-12);
  EXPECT_NEAR(nees->yaw_mean, 0.0036 / 0.0009765625, 1e-12);
  EXPECT_EQ(nees->position_within, 1.0);
  EXPECT_EQ(nees->yaw_within, 1.0);
}

TEST(TrajectoryMetric, NeesKnowsWhichAxesACovarianceIsIn) {
  // The estimate's map is turned by a quarter against the truth's, and the body lies on its side:
  // its x axis is up.
  const Eigen::Quaterniond on_side(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitY()));
  const Pose3d truth_T_estimate{
      {5, 6, 7}, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()))};
  std::vector<PosePair> pairs(2);
  for (PosePair& pair : pairs) {
    pair.estimate.orientation = on_side;
    pair.truth = truth_T_estimate * pair.estimate;
  }
  // 0.5 m along the truth's y axis, which is the estimate's x axis; 0.1 rad about up.
  pairs[1].truth.position.y() += 0.5;
  pairs[1].truth.orientation =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()) * pairs[1].truth.orientation;
  Eigen::Matrix<double, 6, 1> variances;
  variances << 0.25, 4, 4, 0.015625, 4, 4;
  pairs[1].covariance = DiagonalCovariance(variances);
  const auto nees = Nees(pairs);
  ASSERT_TRUE(nees.has_value());
  EXPECT_NEAR(nees->position_mean, 1.0, 1e-9);
  EXPECT_NEAR(nees->yaw_mean, 0.01 / 0.015625, 1e-9);
}

TEST(TrajectoryMetric, NeesTellsRightCovariancesFromTooSmallOnes) {
  std::mt19937_64 random(test::TestSeed(11));
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << 0.1, 0.3, 0.05, 0.01, 0.02, 0.03;
  std::vector<StampedPose> truth = Path(4000);
  std::vector<PosePair> pairs = AssociatePoses(truth, truth);
  const auto covariance = DiagonalCovariance(sigmas.cwiseAbs2());
  for (size_t i = 1; i < pairs.size(); ++i) {
    pairs[i].estimate.position += Eigen::Vector3d(
        sigmas[0] * normal(random), sigmas[1] * normal(random), sigmas[2] * normal(random));
    // The body stays upright, so the turn about the vertical is that about its z axis.
    pairs[i].estimate.orientation =
        pairs[i].estimate.orientation *
        Eigen::AngleAxisd(sigmas[5] * normal(random), Eigen::Vector3d::UnitZ());
    pairs[i].covariance = covariance;
  }
  const auto nees = Nees(pairs);
  EXPECT_NEAR(nees->position_mean, 3.0, 0.2);
  EXPECT_NEAR(nees->yaw_mean, 1.0, 0.12);
  EXPECT_NEAR(nees->position_within, 0.95, 0.02);
  EXPECT_NEAR(nees->yaw_within, 0.95, 0.02);
  for (PosePair& pair : pairs) pair.covariance = DiagonalCovariance(0.25 * sigmas.cwiseAbs2());
  EXPECT_NEAR(Nees(pairs)->position_mean, 4.0 * nees->position_mean, 1e-3);
  EXPECT_LT(Nees(pairs)->position_within, 0.6);
}

TEST(TrajectoryMetric, NeesLeavesOutWhatHasNoInverse) {
  std::vector<PosePair> pairs(3);
  EXPECT_FALSE(Nees(pairs).has_value());
  EXPECT_FALSE(Nees({}).has_value());
  Eigen::Matrix<double, 6, 1> variances = Eigen::Matrix<double, 6, 1>::Ones();
  pairs[1].covariance = DiagonalCovariance(variances);
  variances[1] = 0.0;
  pairs[2].covariance = DiagonalCovariance(variances);
  EXPECT_EQ(Nees(pairs)->pose_count, 1);
  EXPECT_EQ(Nees(pairs)->singular_count, 1);
}

}  // namespace
}  // namespace dsg::evaluation
