// SPDX-License-Identifier: Apache-2.0
// How a torso is turned, from a detection's coefficients or its joints.
// Refuses to know the map, and which way is up in it.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "ingest/agents/detections/cue_options.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

struct TorsoAxes {
  Eigen::Quaterniond camera_R_torso = Eigen::Quaterniond::Identity();
  double heading_sigma_rad = 0.35;
};

/// Frames: torso x forward, y left, z up.
///
/// From the pelvis of the pose coefficients, else from hips, shoulders and neck; nullopt with
/// neither. The pelvis' own axes are the torso's, or SMPL's (x left, y up, z forward) when the
/// joints say so.
std::optional<TorsoAxes> FindTorsoAxes(const HumanDetection& detection,
                                       const PlacementOptions& options);

/// Of the joints that the detection sees, 0 to 1; 1 without joints.
double MeanVisibility(const HumanDetection& detection);

}  // namespace dsg::ingest
