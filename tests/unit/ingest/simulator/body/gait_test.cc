// SPDX-License-Identifier: Apache-2.0
// Feet of walkers and of those who stand are where feet are.
#include "ingest/simulator/body/gait.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ingest/simulator/body/limb_ik.h"

namespace dsg::simulator {
namespace {

constexpr double kPi = std::numbers::pi;

Posture Whole(const BodyModel& body, const GaitState& gait) {
  Posture posture = TrunkPosture(body, gait);
  PlantFeet(body, gait, &posture);
  return posture;
}

double LowestPoint(const BodyModel& body, const Posture& posture) {
  TriangleMesh mesh;
  body.Skin(posture, &mesh);
  double low = 10.0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) low = std::min<double>(low, vertex.z());
  return low + body.pelvis_height_m();
}

TEST(Gait, SolesAreOnTheFloorWhileStanding) {
  for (const double height : {-2.5, 0.0, 2.5}) {
    ShapeCoefficients shape{};
    shape[0] = height;
    const BodyModel body(shape);
    for (double idle_s = 0.0; idle_s < 60.0; idle_s += 1.7) {
      GaitState gait;
      gait.idle_s = idle_s;
      const Posture posture = Whole(body, gait);
      EXPECT_NEAR(LowestPoint(body, posture), 0.0, 0.01);
      const auto joints = body.Joints(posture);
      for (const Side side : {Side::kLeft, Side::kRight}) {
        const double ankle_m = joints[AnkleJoint(side)].z() + body.pelvis_height_m();
        EXPECT_NEAR(ankle_m, 0.08 * body.height_m() / 1.72, 0.012);
      }
    }
  }
}

TEST(Gait, SomeFootIsAlwaysNearTheFloorWhileWalking) {
  const BodyModel body{ShapeCoefficients()};
  for (double phase = 0.0; phase < 2.0 * kPi; phase += 0.05) {
    GaitState gait;
    gait.phase_rad = phase;
    gait.stride = 1.0;
    EXPECT_NEAR(LowestPoint(body, Whole(body, gait)), 0.0, 0.025) << phase;
  }
}

TEST(Gait, PlantedFeetDoNotSlide) {
  const BodyModel body{ShapeCoefficients()};
  const double stride_m = StrideLengthM(body);
  // In the first half of its stance, after the heel strike.
  const auto foot_at = [&](double cycle) {
    GaitState gait;
    gait.phase_rad = 2.0 * kPi * cycle;
    gait.stride = 1.0;
    const auto joints = body.Joints(Whole(body, gait));
    return joints[AnkleJoint(Side::kLeft)].x() + cycle * stride_m;
  };
  const double planted = foot_at(0.1);
  for (double cycle = 0.1; cycle < 0.35; cycle += 0.01) {
    EXPECT_NEAR(foot_at(cycle), planted, 0.01) << cycle;
  }
}

TEST(Gait, PostureChangesSmoothlyWithThePhase) {
  const BodyModel body{ShapeCoefficients()};
  GaitState gait;
  gait.stride = 1.0;
  auto last = body.Joints(Whole(body, gait));
  constexpr double kStep = 0.01;
  for (double phase = kStep; phase < 4.0 * kPi; phase += kStep) {
    gait.phase_rad = phase;
    const auto joints = body.Joints(Whole(body, gait));
    for (int j = 0; j < ingest::kJointCount; ++j) {
      EXPECT_LT((joints[j] - last[j]).norm(), 1.0 * kStep) << j << " at " << phase;
    }
    last = joints;
  }
}

TEST(Gait, ArmsSwingAgainstTheLegs) {
  const BodyModel body{ShapeCoefficients()};
  GaitState gait;
  gait.stride = 1.0;
  const auto joints = body.Joints(Whole(body, gait));
  // The left heel strikes at phase zero.
  EXPECT_GT(joints[7].x(), joints[8].x() + 0.3);
  EXPECT_LT(joints[ingest::kLeftHand].x(), joints[ingest::kRightHand].x() - 0.3);
}

}  // namespace
}  // namespace dsg::simulator
