// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/gait.h"

#include <cmath>
#include <numbers>

#include "ingest/simulator/body/limb_ik.h"

namespace dsg::simulator {
namespace {

/// Steps of this share of the leg's length are those of an easy walk.
constexpr double kStepPerLeg = 0.76;
/// Share of a cycle in which a foot is on the floor.
constexpr double kStance = 0.54;
constexpr double kHeelRiseM = 0.07;
constexpr double kSwingLiftM = 0.06;
constexpr double kTurnLiftM = 0.05;

Eigen::Quaterniond About(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

Eigen::Quaterniond Yaw(double angle_rad) { return About(Eigen::Vector3d::UnitZ(), angle_rad); }
Eigen::Quaterniond Roll(double angle_rad) { return About(Eigen::Vector3d::UnitX(), angle_rad); }

/// Of one foot of a walking body.
struct FootStep {
  /// Forward of the hip, as a share of the stride.
  double forward = 0.0;
  double lift_m = 0.0;
  double pitch_rad = 0.0;
};

// `cycle` in [0, 1): the heel strikes at 0, the toes leave at kStance.
FootStep StepAt(double cycle) {
  FootStep step;
  if (cycle < kStance) {
    const double share = cycle / kStance;
    const double roll_off = SmoothStep((share - 0.65) / 0.35);
    // The body passes over the planted foot at its own speed.
    step.forward = kStance * (0.5 - share);
    step.lift_m = kHeelRiseM * roll_off;
    step.pitch_rad = 0.45 * roll_off - 0.2 * (1.0 - SmoothStep(share / 0.15));
    return step;
  }
  const double share = (cycle - kStance) / (1.0 - kStance);
  step.forward = kStance * (SmoothStep(share) - 0.5);
  step.lift_m =
      kHeelRiseM * (1.0 - SmoothStep(share)) + kSwingLiftM * std::sin(std::numbers::pi * share);
  step.pitch_rad = 0.45 - 0.65 * SmoothStep(share);
  return step;
}

double Fraction(double value) { return value - std::floor(value); }

// Smooth, never repeating within a log, in [-1, 1].
double Drift(double time_s, double period_s) {
  const double a = 2.0 * std::numbers::pi * time_s / period_s;
  return 0.6 * std::sin(a) + 0.4 * std::sin(1.618 * a + 1.0);
}

void BendPelvis(const GaitState& gait, Posture* posture) {
  const double idle = 1.0 - gait.stride;
  const double phase = gait.phase_rad;
  posture->pelvis_offset.x() = 0.006 * idle * Drift(gait.idle_s, 5.3);
  // Over the standing foot: the left one at a quarter of the cycle.
  posture->pelvis_offset.y() =
      0.02 * gait.stride * std::sin(phase) + 0.018 * idle * Drift(gait.idle_s, 7.1);
  // Lowest with both feet on the floor.
  posture->pelvis_offset.z() =
      -gait.stride * (0.048 + 0.018 * std::cos(2.0 * phase)) - 0.006 * idle;
  posture->rotations[0] =
      Yaw(-0.08 * gait.stride * std::cos(phase)) * Roll(0.04 * gait.stride * std::sin(phase));
}

void BendTrunk(const GaitState& gait, Posture* posture) {
  const double idle = 1.0 - gait.stride;
  const double twist = 0.06 * gait.stride * std::cos(gait.phase_rad);
  const double lean = 0.02 * gait.stride + 0.01 * idle * Drift(gait.idle_s, 6.1);
  for (const int spine : {3, 6, 9}) posture->rotations[spine] = Yaw(twist) * Pitch(lean);
  const double look = 0.45 * idle * Drift(gait.idle_s, 9.7) + 0.12 * Drift(gait.idle_s, 13.0);
  posture->rotations[12] = Yaw(0.4 * look);
  posture->rotations[15] = Yaw(0.6 * look - twist) * Pitch(0.05 * Drift(gait.idle_s, 11.0));
}

void SwingArms(const GaitState& gait, Posture* posture) {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const int i = static_cast<int>(side);
    const double out = side == Side::kLeft ? 1.0 : -1.0;
    // Each arm goes with the other side's leg; forward is a negative pitch.
    const double swing = -out * std::cos(gait.phase_rad);
    const double idle = (1.0 - gait.stride) * Drift(gait.idle_s + 3.0 * i, 8.3);
    const double shoulder = 0.38 * gait.stride * swing + 0.04 * idle;
    const double elbow = 0.18 + gait.stride * (0.22 + 0.15 * swing) + 0.05 * idle;
    posture->rotations[ShoulderJoint(side)] = Roll(0.05 * out) * Pitch(-shoulder);
    posture->rotations[18 + i] = Pitch(-elbow);
  }
}

}  // namespace

double StrideLengthM(const BodyModel& body) { return 2.0 * kStepPerLeg * LegLengthM(body); }

Posture TrunkPosture(const BodyModel& body, const GaitState& gait) {
  Posture posture;
  BendPelvis(gait, &posture);
  posture.pelvis_offset *= LegLengthM(body) / 0.8;
  BendTrunk(gait, &posture);
  SwingArms(gait, &posture);
  return posture;
}

void PlantFeet(const BodyModel& body, const GaitState& gait, Posture* posture) {
  const double stride_m = StrideLengthM(body);
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const int i = static_cast<int>(side);
    const FootStep step = StepAt(Fraction(gait.phase_rad / (2.0 * std::numbers::pi) + 0.5 * i));
    // Upright, the ankle is straight below the hip but for the bones' small bends.
    Eigen::Vector3d ankle = body.offset(1 + i) + body.offset(4 + i) + body.offset(7 + i);
    ankle.x() += gait.stride * stride_m * step.forward;
    ankle.z() += gait.stride * step.lift_m;
    // Left and right foot take turns.
    const double turn = std::sin(gait.turn_phase_rad + std::numbers::pi * i);
    ankle.z() += kTurnLiftM * gait.turn_lift * std::max(0.0, turn);
    PutAnkle(body, side, ankle, gait.stride * step.pitch_rad, posture);
  }
}

double SmoothStep(double t) {
  if (t <= 0.0) return 0.0;
  if (t >= 1.0) return 1.0;
  return t * t * (3.0 - 2.0 * t);
}

Eigen::Quaterniond Pitch(double angle_rad) { return About(Eigen::Vector3d::UnitY(), angle_rad); }

}  // namespace dsg::simulator
