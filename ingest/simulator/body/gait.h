// SPDX-License-Identifier: Apache-2.0
// How a body bends while it walks, turns on the spot or stands about.
// Refuses to know where it goes: the phase comes from the walked distance.
#pragma once

#include "ingest/simulator/body/body_model.h"

namespace dsg::simulator {

/// What the legs are doing at one instant.
struct GaitState {
  /// Radians; 2 pi for two steps.
  double phase_rad = 0.0;
  /// 0 standing to 1 full steps.
  double stride = 0.0;
  /// Of small steps on the spot, radians.
  double turn_phase_rad = 0.0;
  /// 0 feet on the floor to 1 full small steps.
  double turn_lift = 0.0;
  /// Any clock that runs on; shifts of weight, looking about.
  double idle_s = 0.0;
};

/// Walked distance of one cycle (two steps), from the length of the legs.
double StrideLengthM(const BodyModel& body);

/// The trunk, the head and the arms. The legs hang until PlantFeet.
Posture TrunkPosture(const BodyModel& body, const GaitState& gait);

/// Puts the feet on the floor, wherever the pelvis of `posture` is.
void PlantFeet(const BodyModel& body, const GaitState& gait, Posture* posture);

/// 0 up to t = 0, 1 from t = 1 on, between them a cubic with flat ends.
double SmoothStep(double t);

/// A rotation about y: forwards and down.
Eigen::Quaterniond Pitch(double angle_rad);

}  // namespace dsg::simulator
