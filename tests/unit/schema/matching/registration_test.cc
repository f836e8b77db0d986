// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/registration.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "schema/base/status.h"
#include "tests/unit/schema/matching/registration_test_util.h"

namespace dsg {
namespace {

// Three standard deviations of the noise that RandomClouds adds.
RegistrationOptions Tight() { return {.noise_bound_m = 0.03}; }

absl::StatusOr<Registration> Solve(const Clouds& clouds, const RegistrationOptions& options) {
  return Register(clouds.source, clouds.target, clouds.correspondences, options);
}

TEST(Registration, IsExactWithoutNoiseAndOutliers) {
  Random random(31, 0);
  const Clouds clouds = RandomClouds({.count = 40, .sigma_m = 0.0}, &random);
  const auto found = Solve(clouds, Tight());
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(RotationErrorDeg(*found, clouds.truth), 1e-5);
  EXPECT_LT(TranslationErrorM(*found, clouds.truth), 1e-9);
  EXPECT_EQ(found->inliers.size(), 40U);
  EXPECT_EQ(found->clique_size, 40);
  EXPECT_TRUE(found->is_clique_maximal);
  EXPECT_LT(found->residual_m, 1e-9);
  EXPECT_LT((*found * clouds.source[3] - clouds.target[3]).norm(), 1e-9);
}

TEST(Registration, NeverUsesAPointTwice) {
  Random random(32, 0);
  Clouds clouds = RandomClouds({.count = 40}, &random);
  // Rivals: every source with one far target, every target with one far source, and all pairs
  // twice.
  for (int i = 0; i < 40; ++i) {
    clouds.correspondences.emplace_back(i, 0);
    clouds.correspondences.emplace_back(0, i);
    clouds.correspondences.emplace_back(i, i);
    clouds.correspondences.emplace_back(i, i);
  }
  const auto found = Solve(clouds, Tight());
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(RotationErrorDeg(*found, clouds.truth), 1.0);
  std::vector<int> source_uses(40, 0);
  std::vector<int> target_uses(40, 0);
  for (const int i : found->inliers) {
    ++source_uses[clouds.correspondences[i].first];
    ++target_uses[clouds.correspondences[i].second];
  }
  EXPECT_EQ(*std::max_element(source_uses.begin(), source_uses.end()), 1);
  EXPECT_EQ(*std::max_element(target_uses.begin(), target_uses.end()), 1);
  EXPECT_GE(found->inliers.size(), 36U);
  EXPECT_LE(found->clique_size, 40);
}

TEST(Registration, IsNotDrawnToAHeapOfPairsAtOnePlace) {
  Random random(33, 0);
  Clouds clouds = RandomClouds({.count = 20, .sigma_m = 0.003}, &random);
  // Two hundred sources and two hundred targets, each all at one place: any pair agrees with any.
  for (int i = 0; i < 200; ++i) {
    clouds.source.emplace_back(3.0, 3.0, 3.0);
    clouds.target.emplace_back(-7.0, 1.0, 2.0);
    clouds.correspondences.emplace_back(20 + i, 20 + i);
  }
  const auto found = Solve(clouds, Tight());
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(RotationErrorDeg(*found, clouds.truth), 1.0);
  EXPECT_EQ(found->inliers.front(), 0);
  EXPECT_EQ(found->inliers.back(), 19);
}

TEST(Registration, RefusesAMirrorImage) {
  Random random(34, 0);
  for (int round = 0; round < 20; ++round) {
    Clouds clouds = RandomClouds({.count = 60, .sigma_m = 0.003}, &random);
    for (Eigen::Vector3d& point : clouds.source) point.x() = -point.x();
    for (const bool is_upright : {false, true}) {
      RegistrationOptions options = Tight();
      options.is_upright = is_upright;
      if (is_upright) {
        for (int i = 0; i < 60; ++i) {
          clouds.target[i] = clouds.source[i].cwiseProduct(Eigen::Vector3d(-1.0, 1.0, 1.0));
        }
      }
      const auto found = Solve(clouds, options);
      EXPECT_EQ(found.status().code(), absl::StatusCode::kNotFound)
          << "seed 34, round " << round << ": " << (found.ok() ? found->inliers.size() : 0U);
    }
  }
}

// Lengths alone cannot tell the right pairs from the mirrored ones.
TEST(Registration, TellsASymmetricObjectFromItsMirrorImage) {
  Random random(35, 0);
  int right_count = 0;
  for (int round = 0; round < 40; ++round) {
    Clouds clouds;
    clouds.truth.rotation = Yaw(random.Uniform(-3.0, 3.0));
    clouds.truth.translation = RandomInBall(&random, 1.0);
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector3d half = RandomInCube(&random, 1.0) + Eigen::Vector3d(0.1, 0.0, 0.0);
      for (const double side : {-1.0, 1.0}) {
        clouds.source.push_back(half.cwiseProduct(Eigen::Vector3d(side, 1.0, 1.0)));
        clouds.target.push_back(clouds.truth * clouds.source.back() + RandomNormal(&random, 0.003));
      }
    }
    RegistrationOptions options = {.noise_bound_m = 0.02, .is_upright = round % 2 == 0};
    const auto found = Register(clouds.source, clouds.target, AllToAll(20, 20), options);
    ASSERT_TRUE(found.ok()) << "seed 35, round " << round << ": " << found.status();
    if (RotationErrorDeg(*found, clouds.truth) < 2.0) ++right_count;
  }
  EXPECT_EQ(right_count, 40) << "seed 35";
}

TEST(Registration, FindsAnUprightMotionAmongWrongPairs) {
  Random random(36, 0);
  for (int round = 0; round < 50; ++round) {
    const Clouds clouds =
        RandomClouds({.count = 100, .outlier_share = 0.9, .is_upright = true}, &random);
    RegistrationOptions options = Tight();
    options.is_upright = true;
    const auto found = Solve(clouds, options);
    ASSERT_TRUE(found.ok()) << "seed 36, round " << round << ": " << found.status();
    EXPECT_LT(RotationErrorDeg(*found, clouds.truth), 2.0) << "seed 36, round " << round;
    EXPECT_LT(TranslationErrorM(*found, clouds.truth), 0.03) << "seed 36, round " << round;
    EXPECT_EQ(found->rotation.col(2), Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
    // Neither roll nor pitch is in doubt.
    EXPECT_EQ((found->covariance.topRows<2>().norm()), 0.0);
    EXPECT_GT(found->covariance(2, 2), 0.0);
  }
}

TEST(Registration, FindsTheScaleAmongWrongPairs) {
  Random random(37, 0);
  for (int round = 0; round < 50; ++round) {
    const double scale = random.Uniform(0.4, 3.0);
    const double share = 0.01 * random.Index(71);
    const Clouds clouds =
        RandomClouds({.count = 100, .outlier_share = share, .scale = scale}, &random);
    RegistrationOptions options = Tight();
    options.estimate_scale = true;
    const auto found = Solve(clouds, options);
    ASSERT_TRUE(found.ok()) << "seed 37, round " << round << ": " << found.status();
    EXPECT_NEAR(found->scale, scale, 0.03) << "seed 37, round " << round << ", share " << share;
    EXPECT_LT(RotationErrorDeg(*found, clouds.truth), 2.0) << "seed 37, round " << round;
    EXPECT_LT(TranslationErrorM(*found, clouds.truth), 0.05) << "seed 37, round " << round;
  }
}

TEST(Registration, LeavesTheScaleAloneUnlessAsked) {
  Random random(38, 0);
  const Clouds clouds = RandomClouds({.count = 50, .scale = 2.0}, &random);
  const auto found = Solve(clouds, Tight());
  EXPECT_TRUE(!found.ok() || found->scale == 1.0);
}

TEST(Registration, NeedsThreePairsOrTwoWhenUpright) {
  const std::vector<Eigen::Vector3d> source = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<Eigen::Vector3d> target;
  const Eigen::Matrix3d turn = Yaw(0.5);
  for (const auto& p : source) target.push_back(turn * p);
  const std::vector<Correspondence> all = {{0, 0}, {1, 1}, {2, 2}};
  for (const size_t count : {0U, 1U, 2U, 3U}) {
    const std::vector<Correspondence> some(all.begin(), all.begin() + count);
    for (const bool is_upright : {false, true}) {
      const auto found =
          Register(source, target, some, {.noise_bound_m = 0.01, .is_upright = is_upright});
      const bool is_enough = count >= (is_upright ? 2U : 3U);
      ASSERT_EQ(found.ok(), is_enough) << count << " pairs, upright " << is_upright;
      if (!is_enough) {
        EXPECT_EQ(found.status().code(), absl::StatusCode::kNotFound);
        continue;
      }
      EXPECT_LT((found->rotation - turn).norm(), 1e-6);
      EXPECT_TRUE(found->covariance.allFinite());
    }
  }
}

TEST(Registration, RefusesPointsInLine) {
  Random random(39, 0);
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;
  std::vector<Correspondence> pairs;
  const Eigen::Matrix3d turn = RandomRotation(&random);
  for (int i = 0; i < 20; ++i) {
    source.push_back(Eigen::Vector3d(0.2, 0.4, 0.9) * i * 0.1);
    target.push_back(turn * source.back() + RandomNormal(&random, 0.005));
    pairs.emplace_back(i, i);
  }
  EXPECT_EQ(Register(source, target, pairs, Tight()).status().code(), absl::StatusCode::kNotFound);
  // Upright, a slanted line tells the heading but a vertical one does not.
  for (Eigen::Vector3d& p : source) p = {0.0, 0.0, p.z()};
  RegistrationOptions upright = Tight();
  upright.is_upright = true;
  EXPECT_EQ(Register(source, source, pairs, upright).status().code(), absl::StatusCode::kNotFound);
}

TEST(Registration, RefusesBadIndicesPointsAndOptions) {
  const std::vector<Eigen::Vector3d> good = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<Eigen::Vector3d> bad = good;
  bad[1].y() = std::numeric_limits<double>::quiet_NaN();
  std::vector<Eigen::Vector3d> far = good;
  far[2].x() = std::numeric_limits<double>::infinity();
  const std::vector<Correspondence> pairs = {{0, 0}, {1, 1}, {2, 2}};
  const auto expect_refused = [](const absl::StatusOr<Registration>& found) {
    EXPECT_EQ(found.status().code(), absl::StatusCode::kInvalidArgument) << found.status();
    EXPECT_EQ(ReasonOf(found.status()), Reason::kFieldInvalid);
  };
  expect_refused(Register(good, bad, pairs, {}));
  expect_refused(Register(far, good, pairs, {}));
  expect_refused(Register(good, good, {{0, 0}, {1, 3}}, {}));
  expect_refused(Register(good, good, {{-1, 0}}, {}));
  expect_refused(Register({}, {}, pairs, {}));
  expect_refused(Register(good, good, pairs, {.correspondence_count_max = 2}));
  for (const double bound : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_refused(Register(good, good, pairs, {.noise_bound_m = bound}));
  }
  expect_refused(Register(good, good, pairs, {.gnc_factor = 1.0}));
  EXPECT_EQ(Register({}, {}, {}, {}).status().code(), absl::StatusCode::kNotFound);
}

TEST(Registration, StaysFiniteOnHugeAndTinyCoordinates) {
  Random random(40, 0);
  for (const double size : {1e-150, 1e150, 1e300}) {
    std::vector<Eigen::Vector3d> source;
    std::vector<Eigen::Vector3d> target;
    for (int i = 0; i < 10; ++i) {
      source.push_back(size * RandomInCube(&random, 1.0));
      target.push_back(size * RandomInCube(&random, 1.0));
    }
    const auto found = Register(source, target, AllToAll(10, 10), {});
    if (!found.ok()) continue;
    EXPECT_TRUE(found->rotation.allFinite() && found->translation.allFinite()) << size;
  }
}

TEST(Registration, GivesTheSameAnswerTwiceAndForAnyOrderOfPairs) {
  Random random(41, 0);
  const Clouds clouds = RandomClouds({.count = 150, .outlier_share = 0.8}, &random);
  const auto first = Solve(clouds, Tight());
  const auto second = Solve(clouds, Tight());
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->rotation, second->rotation);
  EXPECT_EQ(first->translation, second->translation);
  EXPECT_EQ(first->inliers, second->inliers);
  EXPECT_EQ(first->covariance, second->covariance);
  std::vector<Correspondence> reversed(clouds.correspondences.rbegin(),
                                       clouds.correspondences.rend());
  const auto third = Register(clouds.source, clouds.target, reversed, Tight());
  ASSERT_TRUE(third.ok());
  EXPECT_EQ(third->inliers.size(), first->inliers.size());
  EXPECT_LT((third->rotation - first->rotation).norm(), 1e-9);
}

// The share of truths inside the ellipsoid that should hold 95 % of them.
TEST(Registration, HasACovarianceThatHoldsTheTruth) {
  Random random(42, 0);
  constexpr double kChiSquared6At95 = 12.59;
  int inside_count = 0;
  for (int round = 0; round < 300; ++round) {
    const Clouds clouds = RandomClouds({.count = 60}, &random);
    const auto found = Solve(clouds, {.noise_bound_m = 0.06});
    ASSERT_TRUE(found.ok());
    const Eigen::AngleAxisd turn(found->rotation.transpose() * clouds.truth.rotation);
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), clouds.truth.translation - found->translation;
    if (error.dot(found->covariance.inverse() * error) < kChiSquared6At95) ++inside_count;
  }
  EXPECT_GT(inside_count, 270) << "seed 42";
  EXPECT_LT(inside_count, 297) << "seed 42";
}

TEST(AllToAll, PairsEachWithEach) {
  EXPECT_EQ(AllToAll(2, 2), (std::vector<Correspondence>{{0, 0}, {0, 1}, {1, 0}, {1, 1}}));
  EXPECT_TRUE(AllToAll(0, 5).empty());
  EXPECT_TRUE(AllToAll(-1, 5).empty());
}

}  // namespace
}  // namespace dsg
