// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/registration/feature_match.h"

#include <gtest/gtest.h>

#include <limits>

#include "schema/base/status.h"
#include "tests/unit/schema/matching/registration_test_util.h"

namespace dsg::ingest {
namespace {

// A hilly patch of ground of 4 m by 4 m, seen from above.
std::vector<Eigen::Vector3d> Hills() {
  std::vector<Eigen::Vector3d> points;
  for (double x = 0.0; x < 4.0; x += 0.03) {
    for (double y = 0.0; y < 4.0; y += 0.03) {
      const double height = 0.3 * std::sin(2.0 * x) * std::cos(1.3 * y * y) + 0.1 * x * std::sin(y);
      points.emplace_back(x, y, height);
    }
  }
  return points;
}

TEST(ThinCloud, KeepsTheMeanOfEachCubeAndPassesOverHoles) {
  const double hole = std::numeric_limits<double>::quiet_NaN();
  const auto thinned =
      ThinCloud({{0.1, 0.1, 0.1}, {0.3, 0.1, 0.1}, {hole, 0, 0}, {-0.1, 0.1, 0.1}}, 0.5);
  ASSERT_TRUE(thinned.ok());
  ASSERT_EQ(thinned->size(), 2U);
  EXPECT_LT(((*thinned)[0] - Eigen::Vector3d(-0.1, 0.1, 0.1)).norm(), 1e-12);
  EXPECT_LT(((*thinned)[1] - Eigen::Vector3d(0.2, 0.1, 0.1)).norm(), 1e-12);
}

TEST(ThinCloud, RefusesASpacingOrACloudOutOfReason) {
  for (const double spacing : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(ReasonOf(ThinCloud({{0, 0, 0}}, spacing).status()), Reason::kFieldInvalid);
  }
  EXPECT_EQ(ReasonOf(ThinCloud({{1e30, 0, 0}}, 0.1).status()), Reason::kFieldInvalid);
}

TEST(FeatureMatch, FindsAMovedSurfaceAgain) {
  const std::vector<Eigen::Vector3d> target = Hills();
  Random random(71, 0);
  KnownMotion truth;
  truth.rotation = RandomRotation(&random);
  truth.translation = {1.0, -2.0, 0.5};
  const Eigen::Matrix3d back = truth.rotation.transpose();
  std::vector<Eigen::Vector3d> source;
  for (const Eigen::Vector3d& point : target) {
    if (point.x() < 2.5) source.push_back(back * (point - truth.translation));
  }
  FeatureOptions options;
  options.viewpoint = {2.0, 2.0, 10.0};
  const auto there = DescribeCloud(target, options);
  options.viewpoint = back * (options.viewpoint - truth.translation);
  const auto here = DescribeCloud(source, options);
  ASSERT_TRUE(there.ok() && here.ok());
  const auto matches = MatchMutually(*here, *there, 1000);
  const auto found = Register(here->points, there->points, matches, {.noise_bound_m = 0.05});
  ASSERT_TRUE(found.ok()) << "seed 71: " << found.status();
  EXPECT_LT(RotationErrorDeg(*found, truth), 2.0) << "seed 71";
  EXPECT_LT((*found * source[7] - truth * source[7]).norm(), 0.05) << "seed 71";
  EXPECT_EQ(MatchMutually(*here, *there, 5).size(), 5U);
  EXPECT_EQ(MatchMutually(*here, *there, 1000), matches);
}

TEST(FeatureMatch, KeepsTheShareThatStandsOut) {
  FeatureOptions options;
  options.viewpoint = {2.0, 2.0, 10.0};
  const auto all = DescribeCloud(Hills(), options);
  options.distinct_share = 0.25;
  const auto some = DescribeCloud(Hills(), options);
  ASSERT_TRUE(all.ok() && some.ok());
  EXPECT_EQ(some->points.size(), (all->points.size() + 3) / 4);
  EXPECT_EQ(some->descriptors.cols(), static_cast<Eigen::Index>(some->points.size()));
}

TEST(FeatureMatch, OfNothingOrLonelyPointsIsNothing) {
  const auto none = DescribeCloud({}, {});
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->points.empty());
  const auto lonely = DescribeCloud({{0, 0, 0}, {9, 0, 0}}, {});
  ASSERT_TRUE(lonely.ok());
  EXPECT_TRUE(lonely->points.empty());
  EXPECT_TRUE(MatchMutually(*none, *lonely, 10).empty());
}

TEST(FeatureMatch, RefusesLengthsAndSharesOutOfReason) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(ReasonOf(DescribeCloud({}, {.normal_radius_m = bad}).status()),
              Reason::kFieldInvalid);
    EXPECT_EQ(ReasonOf(DescribeCloud({}, {.feature_radius_m = bad}).status()),
              Reason::kFieldInvalid);
    EXPECT_EQ(ReasonOf(DescribeCloud({}, {.distinct_share = bad}).status()), Reason::kFieldInvalid);
  }
}

}  // namespace
}  // namespace dsg::ingest
