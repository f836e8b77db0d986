// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/session_alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

Eigen::Quaterniond Heading(double turn_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ()));
}

const Pose3d kMapTOther{Vector3d(12.0, -7.0, 0.4), Heading(2.3)};

struct TieNoise {
  double position_m = 0.0;
  double turn_rad = 0.0;
};

// The first session stood up to two metres beside where the other one did.
SessionTie TieAt(const Vector3d& at_other, const TieNoise& noise, Random* random) {
  const auto shake = [&](double sigma) {
    return Vector3d(sigma * Vector3d(random->Normal(), random->Normal(), random->Normal()));
  };
  SessionTie tie;
  tie.other_T_body = {at_other, Heading(random->Uniform(-3.0, 3.0))};
  tie.body_T_other_body = {Vector3d(random->Uniform(-2, 2), random->Uniform(-2, 2), 0.0),
                           Heading(random->Uniform(-0.5, 0.5))};
  const Pose3d told{tie.other_T_body.position + shake(noise.position_m),
                    tie.other_T_body.orientation * Heading(noise.turn_rad * random->Normal())};
  tie.map_T_body = kMapTOther * told * tie.body_T_other_body.Inverse();
  return tie;
}

std::vector<SessionTie> TiesOf(int right_count, int wrong_count, const TieNoise& noise) {
  Random random(3, 0);
  std::vector<SessionTie> ties;
  for (int i = 0; i < right_count; ++i) {
    ties.push_back(TieAt(Vector3d(3.0 * i, 1.5 * (i % 3), 0.1), noise, &random));
  }
  for (int i = 0; i < wrong_count; ++i) {
    ties.push_back(TieAt(Vector3d(2.0 * i, -3.0, 0.0), noise, &random));
    ties.back().map_T_body.position +=
        Vector3d(random.Uniform(2.0, 9.0), random.Uniform(-9.0, 9.0), 0.0);
  }
  return ties;
}

TEST(SessionAlignment, IsThatOfTiesWithoutNoise) {
  const auto found = AlignSessions(TiesOf(4, 0, {}), {});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT((found->map_T_other.position - kMapTOther.position).norm(), 1e-9);
  EXPECT_LT(AngleBetween(found->map_T_other.orientation, kMapTOther.orientation), 1e-9);
  EXPECT_EQ(found->agree_count, 4);
  EXPECT_EQ(found->tie_count, 4);
  EXPECT_LT(found->residual_m, 1e-9);
}

TEST(SessionAlignment, AveragesNoiseAndLeavesWrongTiesOut) {
  const auto found = AlignSessions(TiesOf(12, 8, {0.12, 0.02}), {});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->agree_count, 12);
  EXPECT_EQ(found->tie_count, 20);
  const Vector3d middle(16.5, 1.5, 0.1);
  const double miss_m = (found->map_T_other * middle - kMapTOther * middle).norm();
  EXPECT_LT(miss_m, 4.0 * found->position_sigma_m);
  EXPECT_LT(AngleBetween(found->map_T_other.orientation, kMapTOther.orientation),
            4.0 * found->turn_sigma_rad);
  EXPECT_LT(found->turn_sigma_rad, 0.006);
}

TEST(SessionAlignment, IsNotGuessed) {
  const auto refusal = [](const std::vector<SessionTie>& ties) {
    const absl::Status status = AlignSessions(ties, {}).status();
    EXPECT_EQ(ReasonOf(status), Reason::kNoRegistration);
    return std::string(status.message());
  };
  EXPECT_THAT(refusal({}), testing::HasSubstr("0 views"));
  EXPECT_THAT(refusal(TiesOf(2, 0, {})), testing::HasSubstr("2 of these agree"));
  EXPECT_THAT(refusal(TiesOf(5, 6, {})), testing::HasSubstr("11 views"));
  Random random(4, 0);
  std::vector<SessionTie> at_one_place;
  for (int i = 0; i < 6; ++i) at_one_place.push_back(TieAt(Vector3d(4, 4, 0), {}, &random));
  EXPECT_THAT(refusal(at_one_place), testing::HasSubstr("from 1 places"));
}

}  // namespace
}  // namespace dsg::ingest
