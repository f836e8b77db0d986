// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_graph.h"

#include <Eigen/Dense>
#include <cstdio>
#include <vector>

#include "gtest/gtest.h"
#include "tests/unit/ingest/agents/estimation/walker.h"

namespace dsg::ingest {
namespace {

TEST(TorsoGraph, HalvesTheErrorOfACircle) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Walk walk = WalkCircle(WalkerOptions{}, seed);
    TorsoGraph smooth = Track(TorsoOptions{}, walk.observations);
    smooth.SolveAll();
    EXPECT_LT(MeanError(smooth.estimates(), walk.map_T_torso), 0.5 * MeanRawError(walk));
    TorsoGraph paper = Track(Paper(), walk.observations);
    paper.SolveAll();
    EXPECT_LT(MeanError(paper.estimates(), walk.map_T_torso), 0.75 * MeanRawError(walk));
  }
}

// Each detection's direction is wrong by something, and it is missed by less from nearer.
TEST(TorsoGraph, DrawsNobodyTowardsTheCamera) {
  double along_m = 0.0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const Walk walk = WalkCircle(WalkerOptions{}, seed);
    TorsoGraph graph = Track(TorsoOptions{}, walk.observations);
    graph.SolveAll();
    for (size_t i = 0; i < walk.map_T_torso.size(); ++i) {
      const Eigen::Vector3d truth = walk.map_T_torso[i].position;
      const Eigen::Vector3d error = graph.estimates()[i].map_T_torso.position - truth;
      along_m += error.dot((truth - walk.observations[i].camera_map).normalized());
      ++count;
    }
  }
  EXPECT_NEAR(along_m / count, 0.0, 0.1);
}

TEST(TorsoGraph, IsNotPulledByOutliers) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    WalkerOptions options;
    options.ray_sigma_m = 0.2;
    TorsoGraph clean = Track(TorsoOptions{}, WalkCircle(options, seed).observations);
    clean.SolveAll();
    options.outlier_probability = 0.05;
    const Walk walk = WalkCircle(options, seed);
    TorsoGraph graph = Track(TorsoOptions{}, walk.observations);
    graph.SolveAll();
    const double error_m = MeanError(graph.estimates(), walk.map_T_torso);
    EXPECT_LT(error_m, 1.5 * MeanError(clean.estimates(), walk.map_T_torso));
    for (size_t i = 0; i < walk.map_T_torso.size(); ++i) {
      const Eigen::Vector3d error =
          graph.estimates()[i].map_T_torso.position - walk.map_T_torso[i].position;
      EXPECT_LT(error.norm(), 0.8) << "at " << i;
    }
  }
}

TEST(TorsoGraph, IsThePapersLeastSquaresWithoutLoss) {
  TorsoOptions options = Paper();
  options.paper_loss_scale = 0.0;
  WalkerOptions walker;
  walker.count = 30;
  const Walk walk = WalkCircle(walker, 1);
  TorsoGraph graph = Track(options, walk.observations);
  graph.SolveAll();

  const int size = 3 * walker.count;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(size);
  const double step_information = 1.0 / (0.24 * 0.24);
  for (int i = 0; i < walker.count; ++i) {
    const PersonObservation& seen = walk.observations[static_cast<size_t>(i)];
    const Eigen::Matrix3d prior = seen.position_covariance_map.inverse();
    information.block<3, 3>(3 * i, 3 * i) += prior;
    vector.segment<3>(3 * i) += prior * seen.map_T_torso.position;
    if (i == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const int to = 3 * i + axis;
      information(to, to) += step_information;
      information(to - 3, to - 3) += step_information;
      information(to, to - 3) -= step_information;
      information(to - 3, to) -= step_information;
    }
  }
  const Eigen::MatrixXd covariance = information.inverse();
  const Eigen::VectorXd expected = covariance * vector;
  for (int i = 0; i < walker.count; ++i) {
    const TorsoEstimate& estimate = graph.estimates()[static_cast<size_t>(i)];
    EXPECT_LT((estimate.map_T_torso.position - expected.segment<3>(3 * i)).norm(), 1e-6);
    EXPECT_LT((PositionCovariance(estimate) - covariance.block<3, 3>(3 * i, 3 * i)).norm(), 1e-6);
  }
}

TEST(TorsoGraph, EqualsTheFullSolutionWhereTheLagCoversAll) {
  for (const TorsoModel model : {TorsoModel::kPaper, TorsoModel::kSmooth}) {
    TorsoOptions options;
    options.model = model;
    options.lag_count = 1000;
    WalkerOptions walker;
    walker.count = 60;
    walker.cue_sigma_m = 0.2;
    walker.outlier_probability = 0.03;
    const Walk walk = WalkCircle(walker, 3);
    TorsoGraph graph = Track(options, walk.observations);
    for (int i = 0; i < 30; ++i) EXPECT_EQ(graph.SolveRecent(), 0u);
    const std::vector<TorsoEstimate> live = graph.estimates();
    graph.SolveAll();
    for (size_t i = 0; i < live.size(); ++i) {
      const Pose3d& full = graph.estimates()[i].map_T_torso;
      EXPECT_LT((live[i].map_T_torso.position - full.position).norm(), 1e-3) << i;
      EXPECT_LT(AngleBetween(live[i].map_T_torso.orientation, full.orientation), 1e-3) << i;
    }
  }
}

TEST(TorsoGraph, HoldsWhatIsBeforeItsLag) {
  const Walk walk = WalkCircle(WalkerOptions{}, 1);
  TorsoOptions options;
  options.lag_count = 10;
  TorsoGraph graph(options);
  for (size_t i = 0; i < walk.observations.size(); ++i) {
    const std::vector<TorsoEstimate> before = graph.estimates();
    graph.Add(walk.observations[i]);
    const size_t first = graph.SolveRecent();
    EXPECT_EQ(first, i < 10 ? 0 : i - 9);
    for (size_t j = 0; j < first; ++j) {
      EXPECT_EQ(before[j].map_T_torso.position, graph.estimates()[j].map_T_torso.position);
    }
  }
}

TEST(TorsoGraph, KnowsHowWrongItIs) {
  double square = 0.0;
  double heading_square = 0.0;
  int count = 0;
  WalkerOptions walker;
  walker.count = 400;
  TorsoOptions options;
  // White errors, as the walker's are.
  options.lasting_share = 0.0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const Walk walk = WalkCircle(walker, seed);
    TorsoGraph graph = Track(options, walk.observations);
    graph.SolveAll();
    for (size_t i = 0; i < walk.map_T_torso.size(); ++i) {
      const TorsoEstimate& estimate = graph.estimates()[i];
      const Eigen::Vector3d error = estimate.map_T_torso.position - walk.map_T_torso[i].position;
      square += error.dot(PositionCovariance(estimate).inverse() * error);
      const double turn =
          AngleBetween(estimate.map_T_torso.orientation, walk.map_T_torso[i].orientation);
      heading_square += turn * turn / static_cast<double>(estimate.covariance[20]);
      ++count;
    }
  }
  const double nees = square / (3.0 * count);
  std::printf("normalised squares: position %.2f, heading %.2f\n", nees, heading_square / count);
  // Not one: a circle is smoother than the walk that is expected.
  EXPECT_GT(nees, 0.4);
  EXPECT_LT(nees, 1.2);
  EXPECT_GT(heading_square / count, 0.4);
  EXPECT_LT(heading_square / count, 1.2);
}

TEST(TorsoGraph, StandsStillWithThoseWhoStand) {
  Random random(7, 0);
  WalkerOptions options;
  const Pose3d truth = TorsoAt(Eigen::Vector3d(3.0, 2.0, 0.9), 1.0);
  Walk walk;
  for (int i = 0; i < 100; ++i) {
    walk.observations.push_back(
        Seen(truth, Eigen::Vector3d(0.0, -2.0, 1.2), TimeOf(i), options, &random));
    walk.map_T_torso.push_back(truth);
  }
  TorsoGraph graph = Track(TorsoOptions{}, walk.observations);
  graph.SolveAll();
  EXPECT_LT(MeanError(graph.estimates(), walk.map_T_torso), 0.5 * MeanRawError(walk));
  const TorsoPrediction prediction =
      graph.Predict(walk.observations.back().time_ns + 1'000'000'000);
  EXPECT_LT(prediction.velocity_map.norm(), 0.5);
}

TEST(TorsoGraph, TakesWhatACueSaysAlongTheRay) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    WalkerOptions options;
    options.ray_sigma_m = 1.0;
    const Walk without = WalkCircle(options, seed);
    options.cue_sigma_m = 0.1;
    const Walk with = WalkCircle(options, seed);
    TorsoGraph blind = Track(TorsoOptions{}, without.observations);
    TorsoGraph sighted = Track(TorsoOptions{}, with.observations);
    blind.SolveAll();
    sighted.SolveAll();
    EXPECT_LT(MeanError(sighted.estimates(), with.map_T_torso), 0.12);
    EXPECT_LT(MeanError(sighted.estimates(), with.map_T_torso),
              0.4 * MeanError(blind.estimates(), without.map_T_torso));
  }
}

TEST(TorsoGraph, GivesTheSameBytesTwice) {
  WalkerOptions walker;
  walker.outlier_probability = 0.05;
  const Walk walk = WalkCircle(walker, 4);
  TorsoGraph first = Track(TorsoOptions{}, walk.observations);
  TorsoGraph second = Track(TorsoOptions{}, walk.observations);
  first.SolveAll();
  second.SolveAll();
  for (size_t i = 0; i < walk.observations.size(); ++i) {
    EXPECT_EQ(first.estimates()[i].map_T_torso.position,
              second.estimates()[i].map_T_torso.position);
    EXPECT_EQ(first.estimates()[i].map_T_torso.orientation.coeffs(),
              second.estimates()[i].map_T_torso.orientation.coeffs());
    EXPECT_EQ(first.estimates()[i].covariance, second.estimates()[i].covariance);
  }
}

TEST(TorsoGraph, TellsItsFactorsByName) {
  WalkerOptions walker;
  walker.count = 5;
  const Walk walk = WalkCircle(walker, 1);
  const TorsoGraph paper = Track(Paper(), walk.observations);
  const std::vector<PoseFactor> all = paper.Factors(0);
  ASSERT_EQ(all.size(), 9u);
  for (size_t i = 0; i < 5; ++i) {
    const PoseFactor& prior = all[i == 0 ? 0 : 2 * i];
    EXPECT_EQ(prior.type, "detection_prior");
    EXPECT_EQ(prior.from_ns, walk.observations[i].time_ns);
    EXPECT_EQ(prior.to_ns, prior.from_ns);
    EXPECT_EQ(prior.relative_pose.position, walk.observations[i].map_T_torso.position);
    ASSERT_TRUE(prior.information.has_value());
  }
  EXPECT_EQ(all[1].type, "zero_velocity");
  EXPECT_EQ(all[1].from_ns, walk.observations[0].time_ns);
  EXPECT_EQ(all[1].to_ns, walk.observations[1].time_ns);
  EXPECT_EQ(all[1].relative_pose.position, Eigen::Vector3d::Zero());
  EXPECT_NEAR((*all[1].information)[0], 1.0 / (0.24 * 0.24), 1e-3);
  EXPECT_NEAR((*all[1].information)[20], 1.0 / (0.21 * 0.21), 1e-3);
  const std::vector<PoseFactor> recent = Track(TorsoOptions{}, walk.observations).Factors(3);
  ASSERT_EQ(recent.size(), 4u);
  EXPECT_EQ(recent[0].type, "motion");
  EXPECT_EQ(recent[0].from_ns, walk.observations[2].time_ns);
}

}  // namespace
}  // namespace dsg::ingest
