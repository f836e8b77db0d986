// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_verifier.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <iostream>

#include "schema/base/status.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/recognition/made_places.h"

namespace dsg::ingest {
namespace {

PlaceVerifier MadeVerifier(const PlaceVerifierOptions& options = {}) {
  absl::StatusOr<PlaceVerifier> verifier = PlaceVerifier::Make(options);
  EXPECT_TRUE(verifier.ok()) << verifier.status();
  return *std::move(verifier);
}

struct MadeVisit {
  KeyframeFeatures from;
  KeyframeFeatures to;
  Pose3d from_T_to;
};

struct VisitSpec {
  bool from_has_depth = true;
  bool to_has_depth = true;
  double moved_share = 0.0;
  uint64_t seed = 1;
};

// Two looks at one place, of cameras that sit differently on their robots.
MadeVisit MakeVisit(const VisitSpec& spec) {
  const MadePlace place = MakePlace(spec.seed);
  ViewSpec from;
  from.body_T_camera = PoseAt({0.1, -0.05, 0.3}, {-90.0, 5.0, -80.0});
  from.place_T_camera = PoseAt({0.1, 0.0, 0.0}, {0.0, 2.0, 0.0});
  from.has_depth = spec.from_has_depth;
  from.seed = 2 * spec.seed;
  ViewSpec to = from;
  to.body_T_camera = PoseAt({-0.2, 0.1, 0.1}, {-80.0, 10.0, 20.0});
  to.place_T_camera = PoseAt({-0.4, 0.15, 0.3}, {3.0, -8.0, 12.0});
  to.has_depth = spec.to_has_depth;
  to.moved_share = spec.moved_share;
  to.seed = 2 * spec.seed + 1;
  return {MadeKeyframe(place, from), MadeKeyframe(place, to),
          from.body_T_camera * from.place_T_camera.Inverse() * to.place_T_camera *
              to.body_T_camera.Inverse()};
}

// Of the small motion on the right that leads from what was found to the truth.
Eigen::Matrix<double, 6, 1> ErrorOfPose(const PlaceVerdict& verdict, const Pose3d& from_T_to) {
  const Pose3d off = verdict.from_T_to.Inverse() * from_T_to;
  Eigen::Matrix<double, 6, 1> error;
  error << off.position, RotationVectorOf(off.orientation);
  return error;
}

TEST(PlaceVerifier, FindsThePoseOfTheBodies) {
  for (const auto& [from_depth, to_depth] : {std::pair(true, true), {true, false}, {false, true}}) {
    for (const double moved_share : {0.0, 0.25, 0.5}) {
      for (const uint64_t seed : {1u, 2u, 3u}) {
        const MadeVisit visit = MakeVisit({from_depth, to_depth, moved_share, seed});
        const PlaceVerdict verdict = MadeVerifier().Verify(visit.from, visit.to);
        const std::string where =
            testing::PrintToString(std::tuple(from_depth, to_depth, moved_share, seed));
        ASSERT_EQ(verdict.outcome, PlaceOutcome::kVerified) << where << Name(verdict.outcome);
        const Eigen::Matrix<double, 6, 1> error = ErrorOfPose(verdict, visit.from_T_to);
        EXPECT_LT(error.head<3>().norm(), 0.05) << where;
        EXPECT_LT(error.tail<3>().norm(), 0.01) << where;
        EXPECT_LT(error.dot(verdict.information * error), 10.0) << where;
        EXPECT_GT(verdict.inlier_count, 50) << where;
        EXPECT_GE(verdict.match_count, verdict.point_count);
        EXPECT_LT(verdict.chi_square_mean, 1.5) << where;
      }
    }
  }
}

// Without floors the errors are as large as they are said to be: their squares have the mean 6.
TEST(PlaceVerifier, TellsItsUncertainty) {
  PlaceVerifierOptions options;
  options.position_floor_m = 0.0;
  options.turn_floor_deg = 0.0;
  const PlaceVerifier verifier = MadeVerifier(options);
  for (const auto& [from_depth, to_depth] : {std::pair(true, true), {true, false}, {false, true}}) {
    double sum = 0.0;
    constexpr int kRuns = 40;
    for (uint64_t run = 0; run < kRuns; ++run) {
      const MadeVisit visit = MakeVisit({from_depth, to_depth, 0.2, 100 + run});
      const PlaceVerdict verdict = verifier.Verify(visit.from, visit.to);
      ASSERT_EQ(verdict.outcome, PlaceOutcome::kVerified) << run;
      const Eigen::Matrix<double, 6, 1> error = ErrorOfPose(verdict, visit.from_T_to);
      sum += error.dot(verdict.information * error);
    }
    std::cout << "depth " << from_depth << to_depth
              << ": mean squared error in units of the covariance, of 6: " << sum / kRuns << "\n";
    EXPECT_GT(sum / kRuns, 3.0);
    EXPECT_LT(sum / kRuns, 9.0);
  }
}

TEST(PlaceVerifier, FloorsAreTheLeastUncertainty) {
  const MadeVisit visit = MakeVisit({});
  const PlaceVerdict verdict = MadeVerifier().Verify(visit.from, visit.to);
  ASSERT_EQ(verdict.outcome, PlaceOutcome::kVerified);
  const Eigen::Matrix<double, 6, 6> covariance = verdict.information.inverse();
  for (int i = 0; i < 3; ++i) {
    EXPECT_GE(std::sqrt(covariance(i, i)), 0.1);
    EXPECT_LT(std::sqrt(covariance(i, i)), 0.12);
    EXPECT_GE(std::sqrt(covariance(i + 3, i + 3)), 0.6 * M_PI / 180.0);
  }
  EXPECT_TRUE(verdict.information.isApprox(verdict.information.transpose()));
}

// The pose seen from the other one is its inverse.
TEST(PlaceVerifier, BothWaysAreOnePose) {
  const MadeVisit visit = MakeVisit({.moved_share = 0.2});
  const PlaceVerdict there = MadeVerifier().Verify(visit.from, visit.to);
  const PlaceVerdict back = MadeVerifier().Verify(visit.to, visit.from);
  ASSERT_EQ(there.outcome, PlaceOutcome::kVerified);
  ASSERT_EQ(back.outcome, PlaceOutcome::kVerified);
  const Pose3d round = there.from_T_to * back.from_T_to;
  EXPECT_LT(round.position.norm(), 0.03);
  EXPECT_LT(DegreesOfTurn(round.orientation, Eigen::Quaterniond::Identity()), 0.5);
}

TEST(PlaceVerifier, WithoutDepthsOnlyADirectionIsKnown) {
  const MadeVisit visit = MakeVisit({.from_has_depth = false, .to_has_depth = false});
  const PlaceVerdict verdict = MadeVerifier().Verify(visit.from, visit.to);
  ASSERT_EQ(verdict.outcome, PlaceOutcome::kDirectionOnly);
  const Pose3d truth =
      visit.from.camera.body_T_camera.Inverse() * visit.from_T_to * visit.to.camera.body_T_camera;
  EXPECT_NEAR(verdict.camera_from_T_to.position.norm(), 1.0, 1e-9);
  EXPECT_LT(verdict.camera_from_T_to.position.cross(truth.position.normalized()).norm(), 0.05);
  EXPECT_LT(DegreesOfTurn(verdict.camera_from_T_to.orientation, truth.orientation), 0.5);
}

// A direction is no loop closure: samples of five are for cameras that never know a depth.
TEST(PlaceVerifier, WithFewDepthsNothingIsTold) {
  MadeVisit visit = MakeVisit({.from_has_depth = true, .to_has_depth = false});
  for (size_t i = 5; i < visit.from.features.size(); ++i) visit.from.features[i].depth_m = 0.0f;
  const PlaceVerdict verdict = MadeVerifier().Verify(visit.from, visit.to);
  EXPECT_EQ(verdict.outcome, PlaceOutcome::kTooFewMatches);
  EXPECT_GT(verdict.match_count, 100);
  EXPECT_EQ(verdict.draw_count, 0);
}

TEST(PlaceVerifier, RefusesOtherPlaces) {
  const MadeVisit one = MakeVisit({.seed = 1});
  const MadeVisit other = MakeVisit({.seed = 2});
  EXPECT_EQ(MadeVerifier().Verify(one.from, other.to).outcome, PlaceOutcome::kTooFewMatches);
  EXPECT_EQ(MadeVerifier().Verify(KeyframeFeatures(), KeyframeFeatures()).outcome,
            PlaceOutcome::kTooFewMatches);
}

// What looks alike but stands elsewhere: another arrangement of the same things.
TEST(PlaceVerifier, RefusesTheSameThingsElsewhere) {
  for (const uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    for (const bool has_depth : {true, false}) {
      const MadeVisit visit = MakeVisit({has_depth, has_depth, /*moved_share=*/1.0, seed});
      const PlaceVerdict verdict = MadeVerifier().Verify(visit.from, visit.to);
      EXPECT_GT(verdict.match_count, 100);
      EXPECT_TRUE(verdict.outcome == PlaceOutcome::kDisagree ||
                  verdict.outcome == PlaceOutcome::kTooFewInliers)
          << Name(verdict.outcome) << " with " << verdict.inlier_count;
    }
  }
}

// A mirrored place fits no pose, though its points are as far from each other.
TEST(PlaceVerifier, RefusesMirrors) {
  MadeVisit visit = MakeVisit({});
  for (KeyframeFeature& feature : visit.to.features) {
    feature.pixel.x() = static_cast<float>(visit.to.camera.width) - feature.pixel.x();
  }
  EXPECT_NE(MadeVerifier().Verify(visit.from, visit.to).outcome, PlaceOutcome::kVerified);
}

TEST(PlaceVerifier, OnePosterIsNoPlace) {
  MadePlace place = MakePlace(1);
  for (Eigen::Vector3d& point : place.points) {
    point = {0.1 * point.x() / point.z(), 0.1 * point.y() / point.z(), 3.0};
  }
  ViewSpec view;
  const KeyframeFeatures from = MadeKeyframe(place, view);
  view.seed = 2;
  EXPECT_EQ(MadeVerifier().Verify(from, MadeKeyframe(place, view)).outcome,
            PlaceOutcome::kClustered);
}

TEST(PlaceVerifier, RefusesWhatIsLooseOrFar) {
  PlaceVerifierOptions options;
  options.position_sigma_max_m = 0.001;
  const MadeVisit visit = MakeVisit({});
  EXPECT_EQ(MadeVerifier(options).Verify(visit.from, visit.to).outcome, PlaceOutcome::kLoose);
  options = {};
  options.distance_m_max = 0.2;
  const PlaceVerdict verdict = MadeVerifier(options).Verify(visit.from, visit.to);
  EXPECT_EQ(verdict.outcome, PlaceOutcome::kTooFar);
  EXPECT_GT(verdict.camera_from_T_to.position.norm(), 0.2);
}

TEST(PlaceVerifier, SaysTheSameAgain) {
  const MadeVisit visit = MakeVisit({.moved_share = 0.5});
  const PlaceVerdict once = MadeVerifier().Verify(visit.from, visit.to);
  const PlaceVerdict again = MadeVerifier().Verify(visit.from, visit.to);
  EXPECT_EQ(once.from_T_to.position, again.from_T_to.position);
  EXPECT_EQ(once.information, again.information);
  EXPECT_EQ(once.draw_count, again.draw_count);
}

TEST(PlaceVerifier, RefusesOptionsOutOfRange) {
  PlaceVerifierOptions options;
  options.match_ratio = 2.0;
  EXPECT_EQ(ReasonOf(PlaceVerifier::Make(options).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
