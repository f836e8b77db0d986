// SPDX-License-Identifier: Apache-2.0
// Taking a thing from a table and putting it down: how far to lean, how deep to go into the
// knees, which hand. Refuses targets that a body cannot touch from where it stands.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ingest/simulator/body/body_model.h"
#include "ingest/simulator/body/gait.h"
#include "ingest/simulator/body/limb_ik.h"

namespace dsg::simulator {

/// How a body touches one point.
struct ReachPlan {
  Side side = Side::kRight;
  double lean_rad = 0.0;
  /// The pelvis goes down by this, metres.
  double drop_m = 0.0;

  /// The less the easier.
  double Effort() const { return lean_rad + 3.0 * drop_m; }
};

/// The easiest way to put that hand on the target, or none. Frames: torso.
std::optional<ReachPlan> FindReach(const BodyModel& body, Side side,
                                   const Eigen::Vector3d& target_torso);

/// Bends trunk and knees; `share` 0 = not yet, 1 = touching. Call before PlantFeet.
void LeanForReach(const ReachPlan& plan, double share, Posture* posture);

/// Moves the arm from where it is (share 0) to the target (share 1).
void StretchArm(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso, double share,
                Posture* posture);

/// Where a hand holds something while the body walks, torso frame.
Eigen::Vector3d CarryPoint(const BodyModel& body, Side side);

}  // namespace dsg::simulator
