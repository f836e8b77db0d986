// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/reach.h"

#include <array>
#include <cmath>

namespace dsg::simulator {
namespace {

constexpr double kLeanStepRad = 0.1;
constexpr int kLeanStepCount = 11;
constexpr std::array<double, 5> kDropsM = {0.0, 0.12, 0.24, 0.36, 0.48};
/// Of the arm's length: neither stretched quite nor folded.
constexpr double kReachMax = 0.96;
constexpr double kReachMin = 0.4;

// The trunk sways a little all the time, hence the margins.
bool IsTouchable(const BodyModel& body, const Eigen::Vector3d& target, const ReachPlan& plan) {
  Posture posture;
  LeanForReach(plan, 1.0, &posture);
  const Eigen::Vector3d shoulder = body.Joints(posture)[ShoulderJoint(plan.side)];
  const double arm_m = ArmLengthM(body);
  const double distance_m = (target - shoulder).norm();
  return distance_m <= kReachMax * arm_m && distance_m >= kReachMin * arm_m;
}

}  // namespace

std::optional<ReachPlan> FindReach(const BodyModel& body, Side side,
                                   const Eigen::Vector3d& target_torso) {
  std::optional<ReachPlan> best;
  for (const double drop_m : kDropsM) {
    for (int i = 0; i < kLeanStepCount; ++i) {
      const ReachPlan plan = {side, kLeanStepRad * i, drop_m};
      if (best.has_value() && best->Effort() <= plan.Effort()) continue;
      if (IsTouchable(body, target_torso, plan)) best = plan;
    }
  }
  return best;
}

void LeanForReach(const ReachPlan& plan, double share, Posture* posture) {
  const double lean = share * plan.lean_rad;
  // The hips go back, so that the body does not fall over.
  posture->pelvis_offset.x() -= 0.1 * std::sin(lean);
  posture->pelvis_offset.z() -= share * plan.drop_m;
  posture->rotations[0] = posture->rotations[0] * Pitch(0.4 * lean);
  for (const int spine : {3, 6, 9}) {
    posture->rotations[spine] = posture->rotations[spine] * Pitch(0.2 * lean);
  }
  // Idle arms hang down.
  for (const int shoulder : {16, 17}) {
    posture->rotations[shoulder] = Pitch(-0.9 * lean) * posture->rotations[shoulder];
  }
  // The eyes follow the hand.
  posture->rotations[15] =
      Eigen::Quaterniond::Identity().slerp(1.0 - share, posture->rotations[15]) *
      Pitch(0.3 * share);
}

void StretchArm(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso, double share,
                Posture* posture) {
  if (share <= 0.0) return;
  Posture stretched = *posture;
  PutHand(body, side, target_torso, &stretched);
  for (const int joint : {16, 18, 20, 22}) {
    const int j = joint + static_cast<int>(side);
    posture->rotations[j] = posture->rotations[j].slerp(share, stretched.rotations[j]);
  }
}

Eigen::Vector3d CarryPoint(const BodyModel& body, Side side) {
  const double out = side == Side::kLeft ? 1.0 : -1.0;
  const double scale = body.height_m() / 1.72;
  return scale * Eigen::Vector3d(0.34, 0.12 * out, 0.16);
}

}  // namespace dsg::simulator
