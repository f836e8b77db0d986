// SPDX-License-Identifier: Apache-2.0
// Hands get where they are sent, or the target is refused.
#include "ingest/simulator/body/reach.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

Posture Reaching(const BodyModel& body, const ReachPlan& plan, const Eigen::Vector3d& target,
                 double share, double idle_s) {
  GaitState gait;
  gait.idle_s = idle_s;
  Posture posture = TrunkPosture(body, gait);
  LeanForReach(plan, share, &posture);
  PlantFeet(body, gait, &posture);
  StretchArm(body, plan.side, target, share, &posture);
  return posture;
}

TEST(Reach, HandTouchesWhateverAPlanWasFoundFor) {
  const uint64_t seed = 5;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  int found = 0;
  for (int i = 0; i < 400; ++i) {
    ShapeCoefficients shape;
    for (double& value : shape) value = std::clamp(random.Normal(), -2.5, 2.5);
    const BodyModel body(shape);
    const double x = random.Uniform(0.3, 0.9);
    const double y = random.Uniform(-0.15, 0.15);
    const double z = random.Uniform(0.4, 1.4) - body.pelvis_height_m();
    const Eigen::Vector3d target(x, y, z);
    const Side side = random.Chance(0.5) ? Side::kLeft : Side::kRight;
    const std::optional<ReachPlan> plan = FindReach(body, side, target);
    if (!plan.has_value()) continue;
    ++found;
    const Posture posture = Reaching(body, *plan, target, 1.0, random.Uniform(0.0, 100.0));
    EXPECT_LT((body.Joints(posture)[HandJoint(side)] - target).norm(), 0.01);
  }
  EXPECT_GT(found, 200);
}

TEST(Reach, RefusesWhatIsTooFar) {
  const BodyModel body{ShapeCoefficients()};
  EXPECT_FALSE(FindReach(body, Side::kRight, {2.0, 0.0, 0.0}).has_value());
  EXPECT_FALSE(FindReach(body, Side::kRight, {0.4, 0.0, 2.0}).has_value());
}

TEST(Reach, FeetStayOnTheFloorHoweverDeepOneBends) {
  const BodyModel body{ShapeCoefficients()};
  const Eigen::Vector3d target(0.5, 0.0, 0.45 - body.pelvis_height_m());
  const std::optional<ReachPlan> plan = FindReach(body, Side::kRight, target);
  ASSERT_TRUE(plan.has_value());
  EXPECT_GT(plan->Effort(), 0.5);
  for (double share = 0.0; share <= 1.0; share += 0.05) {
    const auto joints = body.Joints(Reaching(body, *plan, target, share, 0.0));
    for (const int ankle : {7, 8}) {
      EXPECT_NEAR(joints[ankle].z() + body.pelvis_height_m(), 0.08, 0.015);
    }
  }
}

TEST(Reach, ShareZeroIsThePostureAsItWas) {
  const BodyModel body{ShapeCoefficients()};
  const Posture before = TrunkPosture(body, GaitState());
  Posture after = before;
  LeanForReach({Side::kRight, 0.6, 0.1}, 0.0, &after);
  StretchArm(body, Side::kRight, {0.4, 0.0, 0.2}, 0.0, &after);
  const auto joints = body.Joints(before);
  const auto joints_after = body.Joints(after);
  for (int j = 0; j < ingest::kJointCount; ++j) {
    EXPECT_LT((joints[j] - joints_after[j]).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace dsg::simulator
