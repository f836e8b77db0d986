// SPDX-License-Identifier: Apache-2.0
// Rotations of a torso against the least squares that they stand for.
#include "ingest/agents/estimation/attitude_chain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ingest/agents/estimation/torso_graph.h"
#include "schema/base/random.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/agents/estimation/walker.h"

namespace dsg::ingest {
namespace {

constexpr double kStepS = 0.2;

Eigen::Vector3d RandomVector(double sigma, Random* random) {
  return {sigma * random->Normal(), sigma * random->Normal(), sigma * random->Normal()};
}

// Who turns by ten radians, leans over, and is detected with noise about all axes.
std::vector<PersonObservation> Turning(int count, uint64_t seed, double noise_rad = 0.2) {
  Random random(seed, 0);
  std::vector<PersonObservation> seen;
  for (int i = 0; i < count; ++i) {
    PersonObservation observation = StandingAt(1.0, TimeOf(i));
    const Eigen::Quaterniond leaning(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
    observation.map_T_torso.orientation = TorsoAt({1.0, 0.0, 0.95}, 10.0 * i / count).orientation *
                                          leaning * RotationOf(RandomVector(noise_rad, &random));
    observation.has_heading = i % 7 != 3;
    seen.push_back(observation);
  }
  return seen;
}

// Half of the sum of squares, of rotations of the nodes each turned by a small rotation.
double CostOf(const AttitudeChain& chain, const std::vector<PersonObservation>& seen,
              const TorsoOptions& options, const std::vector<Eigen::Vector3d>& turns) {
  const auto rotation = [&](size_t i) { return chain.rotation(i) * RotationOf(turns[i]); };
  double sum = 0.0;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].has_heading) {
      const Eigen::Vector3d off = RotationVectorOf(
          (seen[i].map_T_torso.orientation.conjugate() * rotation(i)).normalized());
      const double tilt = options.tilt_sigma_rad;
      sum += (off.array() / Eigen::Array3d(tilt, tilt, seen[i].heading_sigma_rad)).square().sum();
    }
    if (i == 0) continue;
    const double turned_rad = rotation(i - 1).angularDistance(rotation(i));
    sum += std::pow(turned_rad / (options.turn_sigma_rad_s * kStepS), 2);
  }
  return 0.5 * sum;
}

TEST(AttitudeChain, EndsWhereNoSmallTurnIsBetter) {
  const TorsoOptions options = Paper();
  const std::vector<PersonObservation> seen = Turning(40, 1);
  AttitudeChain chain(options);
  for (const PersonObservation& observation : seen) chain.Append(observation, kStepS);
  chain.Solve(0, 50, false);
  std::vector<Eigen::Vector3d> turns(seen.size(), Eigen::Vector3d::Zero());
  const double least = CostOf(chain, seen, options, turns);
  constexpr double kStepRad = 1e-4;
  for (size_t i = 0; i < seen.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      turns[i](axis) = kStepRad;
      const double ahead = CostOf(chain, seen, options, turns);
      turns[i](axis) = -kStepRad;
      const double behind = CostOf(chain, seen, options, turns);
      turns[i](axis) = 0.0;
      EXPECT_NEAR((ahead - behind) / (2.0 * kStepRad), 0.0, 1e-4) << i << " axis " << axis;
      EXPECT_GT(std::min(ahead, behind), least) << i << " axis " << axis;
    }
  }
}

TEST(AttitudeChain, SmoothsRollAndPitchToo) {
  const std::vector<PersonObservation> seen = Turning(200, 2, /*noise_rad=*/0.1);
  const std::vector<PersonObservation> truth = Turning(200, 2, /*noise_rad=*/0.0);
  TorsoGraph graph(Paper());
  for (const PersonObservation& observation : seen) {
    ASSERT_TRUE(graph.Add(observation));
    graph.SolveRecent();
  }
  graph.SolveAll();
  double raw = 0.0;
  double smoothed = 0.0;
  double tilt_squares = 0.0;
  int count = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i].has_heading) continue;
    const Eigen::Quaterniond& right = truth[i].map_T_torso.orientation;
    const TorsoEstimate& estimate = graph.estimates()[i];
    const Eigen::Vector3d off =
        RotationVectorOf((right.conjugate() * estimate.map_T_torso.orientation).normalized());
    raw += std::pow(AngleBetween(right, seen[i].map_T_torso.orientation), 2);
    smoothed += off.squaredNorm();
    tilt_squares += off.x() * off.x() / static_cast<double>(estimate.covariance[15]);
    ++count;
  }
  EXPECT_LT(std::sqrt(smoothed), 0.8 * std::sqrt(raw));
  // Covariances know it: noise about x is what --track-tilt says.
  EXPECT_GT(tilt_squares / count, 0.5);
  EXPECT_LT(tilt_squares / count, 2.0);
}

TEST(AttitudeChain, ANodeWithoutADetectedRotationTurnsWithItsNeighbours) {
  AttitudeChain chain(Paper());
  for (int i = 0; i < 11; ++i) {
    PersonObservation observation = StandingAt(1.0, TimeOf(i));
    observation.has_heading = i == 0 || i == 10;
    observation.heading_sigma_rad = 0.01;
    observation.map_T_torso.orientation = TorsoAt({1.0, 0.0, 0.95}, 0.1 * i).orientation;
    if (i == 5) observation.map_T_torso.orientation.setIdentity();
    chain.Append(observation, kStepS);
  }
  chain.Solve(0, 30, false);
  for (size_t i = 0; i < 11; ++i) {
    const Eigen::Vector3d x = chain.rotation(i) * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(std::atan2(x.y(), x.x()), 0.1 * static_cast<double>(i), 1e-3) << i;
  }
  EXPECT_GT(chain.covariance(5)(2, 2), 4.0 * chain.covariance(0)(2, 2));
}

}  // namespace
}  // namespace dsg::ingest
