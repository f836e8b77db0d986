// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_graph.h"

#include <cmath>
#include <limits>
#include <vector>

#include "gtest/gtest.h"
#include "tests/unit/ingest/agents/estimation/walker.h"

namespace dsg::ingest {
namespace {

constexpr double kPi = 3.14159265358979;

TEST(TorsoGraphEdges, ReplacesAFirstDetectionThatWasWrong) {
  TorsoGraph graph{TorsoOptions{}};
  for (int i = 0; i < 12; ++i) {
    graph.Add(StandingAt(i == 0 ? 4.0 : 1.0, TimeOf(i)));
    graph.SolveRecent();
  }
  EXPECT_NEAR(graph.estimates().back().map_T_torso.position.x(), 1.0, 0.05);
  graph.SolveAll();
  EXPECT_NEAR(graph.estimates()[0].map_T_torso.position.x(), 1.0, 0.3);
}

TEST(TorsoGraphEdges, PredictsAWalkerAheadAndThePaperOneStanding) {
  std::vector<PersonObservation> seen;
  for (int i = 0; i < 30; ++i) {
    seen.push_back(StandingAt(0.2 * i, TimeOf(i)));
  }
  const TimeNs later_ns = seen.back().time_ns + 500'000'000;
  const TorsoPrediction smooth = Track(TorsoOptions{}, seen).Predict(later_ns);
  // A little slower than now: most who walk stop.
  EXPECT_NEAR(smooth.velocity_map.x(), 0.8, 0.2);
  EXPECT_NEAR(smooth.position_map.x(), 5.8 + 0.4, 0.2);
  const TorsoPrediction paper = Track(Paper(), seen).Predict(later_ns);
  EXPECT_EQ(paper.velocity_map, Eigen::Vector3d::Zero());
  EXPECT_NEAR(paper.position_map.x(), 5.8, 0.2);
  EXPECT_GT(paper.covariance_map(0, 0), 0.36);
}

TEST(TorsoGraphEdges, IsLessSureOfPeopleTheLongerTheyAreUnseen) {
  for (const TorsoModel model : {TorsoModel::kPaper, TorsoModel::kSmooth}) {
    TorsoOptions options;
    options.model = model;
    TorsoGraph graph(options);
    graph.Add(StandingAt(1.0, kWalkBeginNs));
    graph.SolveRecent();
    double before = 0.0;
    for (const TimeNs ahead_ns : {TimeNs{0}, TimeNs{200'000'000}, TimeNs{5'000'000'000}}) {
      const Eigen::Matrix3d covariance = graph.Predict(kWalkBeginNs + ahead_ns).covariance_map;
      EXPECT_GT(covariance(0, 0), before);
      before = covariance(0, 0);
    }
    // Nobody walks further in five seconds than about 12 metres.
    EXPECT_LT(std::sqrt(before), 7.0);
  }
}

TEST(TorsoGraphEdges, CrossesGapsWithoutRunningAway) {
  TorsoGraph graph{TorsoOptions{}};
  TimeNs time_ns = kWalkBeginNs;
  for (int i = 0; i < 40; ++i) {
    time_ns += i == 20 ? 4'000'000'000 : 200'000'000;
    const double x = 1.2e-9 * static_cast<double>(time_ns - kWalkBeginNs);
    ASSERT_TRUE(graph.Add(StandingAt(x, time_ns)));
    graph.SolveRecent();
  }
  graph.SolveAll();
  for (const TorsoEstimate& estimate : graph.estimates()) {
    const double x = 1.2e-9 * static_cast<double>(estimate.time_ns - kWalkBeginNs);
    EXPECT_NEAR(estimate.map_T_torso.position.x(), x, 0.1);
  }
}

TEST(TorsoGraphEdges, TurnsTheShortWayThroughBehind) {
  TorsoGraph graph{TorsoOptions{}};
  for (int i = 0; i < 60; ++i) {
    PersonObservation seen = StandingAt(1.0, TimeOf(i));
    seen.map_T_torso = TorsoAt(seen.map_T_torso.position, 0.2 * i);
    graph.Add(seen);
    graph.SolveRecent();
  }
  graph.SolveAll();
  for (int i = 0; i < 60; ++i) {
    const double heading = Heading(graph.estimates()[static_cast<size_t>(i)].map_T_torso);
    EXPECT_LT(std::abs(std::remainder(heading - 0.2 * i, 2.0 * kPi)), 0.2) << i;
  }
}

TEST(TorsoGraphEdges, DoesNotTurnAroundForOneFlippedDetection) {
  TorsoGraph graph{TorsoOptions{}};
  for (int i = 0; i < 30; ++i) {
    PersonObservation seen = StandingAt(1.0, TimeOf(i));
    if (i == 15) seen.map_T_torso = TorsoAt(seen.map_T_torso.position, 0.5 + kPi);
    graph.Add(seen);
    graph.SolveRecent();
  }
  graph.SolveAll();
  for (const TorsoEstimate& estimate : graph.estimates()) {
    EXPECT_NEAR(Heading(estimate.map_T_torso), 0.5, 0.3);
  }
}

TEST(TorsoGraphEdges, KeepsItsHeadingThroughDetectionsThatGiveNone) {
  TorsoGraph graph{TorsoOptions{}};
  for (int i = 0; i < 10; ++i) {
    PersonObservation seen = StandingAt(1.0, TimeOf(i));
    if (i > 4) {
      seen.has_heading = false;
      seen.map_T_torso.orientation.setIdentity();
    }
    graph.Add(seen);
    graph.SolveRecent();
  }
  const std::vector<TorsoEstimate>& estimates = graph.estimates();
  EXPECT_NEAR(Heading(estimates.back().map_T_torso), 0.5, 0.05);
  EXPECT_GT(estimates.back().covariance[20], estimates[4].covariance[20]);
}

TEST(TorsoGraphEdges, StandsOnOneDetectionAlone) {
  for (const TorsoModel model : {TorsoModel::kPaper, TorsoModel::kSmooth}) {
    TorsoOptions options;
    options.model = model;
    TorsoGraph graph(options);
    graph.SolveAll();
    EXPECT_EQ(graph.SolveRecent(), 0u);
    const PersonObservation seen = StandingAt(2.0, kWalkBeginNs);
    ASSERT_TRUE(graph.Add(seen));
    EXPECT_EQ(graph.SolveRecent(), 0u);
    graph.SolveAll();
    ASSERT_EQ(graph.estimates().size(), 1u);
    const TorsoEstimate& estimate = graph.estimates()[0];
    EXPECT_LT((estimate.map_T_torso.position - seen.map_T_torso.position).norm(), 1e-5);
    EXPECT_NEAR(Heading(estimate.map_T_torso), 0.5, 0.01);
    EXPECT_LT((PositionCovariance(estimate) - seen.position_covariance_map).norm(), 1e-5);
    EXPECT_EQ(graph.Factors(0).size(), 1u);
  }
}

TEST(TorsoGraphEdges, RefusesWhatItCannotUse) {
  TorsoGraph graph{TorsoOptions{}};
  ASSERT_TRUE(graph.Add(StandingAt(1.0, kWalkBeginNs)));
  EXPECT_FALSE(graph.Add(StandingAt(1.0, kWalkBeginNs)));
  EXPECT_FALSE(graph.Add(StandingAt(1.0, kWalkBeginNs - 1)));
  PersonObservation broken = StandingAt(1.0, kWalkBeginNs + 1);
  broken.position_covariance_map(2, 2) = 0.0;
  EXPECT_FALSE(graph.Add(broken));
  broken = StandingAt(std::numeric_limits<double>::quiet_NaN(), kWalkBeginNs + 1);
  EXPECT_FALSE(graph.Add(broken));
  broken = StandingAt(1.0, kWalkBeginNs + 1);
  broken.heading_sigma_rad = 0.0;
  EXPECT_FALSE(graph.Add(broken));
  EXPECT_FALSE(graph.Add(StandingAt(1e300, kWalkBeginNs + 1)));
  broken = StandingAt(1.0, kWalkBeginNs + 1);
  broken.cues.emplace_back();
  broken.cues.back().torso_map.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(graph.Add(broken));
  EXPECT_EQ(graph.estimates().size(), 1u);
}

TEST(TorsoGraphEdges, SurvivesNeighboursOneNanosecondApart) {
  for (const TorsoModel model : {TorsoModel::kPaper, TorsoModel::kSmooth}) {
    TorsoOptions options;
    options.model = model;
    TorsoGraph graph(options);
    for (int i = 0; i < 50; ++i) {
      ASSERT_TRUE(graph.Add(StandingAt(1.0, kWalkBeginNs + i)));
      graph.SolveRecent();
    }
    graph.SolveAll();
    EXPECT_NEAR(graph.estimates().back().map_T_torso.position.x(), 1.0, 1e-3);
  }
}

TEST(TorsoGraphEdges, SurvivesDetectionsFromWhereTheCameraIs) {
  TorsoGraph graph{TorsoOptions{}};
  PersonObservation seen = StandingAt(1.0, kWalkBeginNs);
  seen.camera_map = seen.map_T_torso.position;
  ASSERT_TRUE(graph.Add(seen));
  graph.SolveAll();
  EXPECT_TRUE(graph.estimates()[0].map_T_torso.position.allFinite());
}

}  // namespace
}  // namespace dsg::ingest
