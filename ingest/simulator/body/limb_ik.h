// SPDX-License-Identifier: Apache-2.0
// Bends an arm or a leg so that its end is where one wants it: two-bone inverse kinematics.
// Refuses to move the trunk; what is out of reach is approached as far as the limb goes.
#pragma once

#include <Eigen/Core>

#include "ingest/simulator/body/body_model.h"

namespace dsg::simulator {

enum class Side { kLeft = 0, kRight = 1 };

/// From the hip to the ankle, stretched, metres.
double LegLengthM(const BodyModel& body);
/// From the shoulder to the middle of the hand, stretched, metres.
double ArmLengthM(const BodyModel& body);

inline int AnkleJoint(Side side) { return 7 + static_cast<int>(side); }
inline int ShoulderJoint(Side side) { return 16 + static_cast<int>(side); }
inline int HandJoint(Side side) { return 22 + static_cast<int>(side); }

/// Sets hip, knee and ankle so that the ankle is at the target, the knee in front, and the foot
/// pitched (toes down positive) against the torso frame. Frames: torso.
void PutAnkle(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso,
              double foot_pitch_rad, Posture* posture);

/// Sets shoulder, elbow and wrist so that the hand is at the target, elbow down and out.
/// Frames: torso.
void PutHand(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso,
             Posture* posture);

}  // namespace dsg::simulator
