// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

}  // namespace
}  // namespace dsg::evaluation
