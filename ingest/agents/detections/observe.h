// SPDX-License-Identifier: Apache-2.0
// From a detection, the camera's pose and what else is known to an observation in the map.
// Refuses to look at other detections.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "ingest/agents/person_observation.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct CueOptions {
  /// False: nothing beyond the detection, as in the paper.
  bool is_floor_used = true;
  bool is_depth_used = true;
  bool is_height_used = true;
  /// Of a standing torso above its floor, metres.
  double torso_height_m = 0.95;
  double torso_height_sigma_m = 0.15;
};

/// What surrounds a detection.
struct ObservationContext {
  Pose3d map_T_camera;
  const CameraCalibration* camera = nullptr;
  /// Of the same moment (some milliseconds), of a camera near by; null = none.
  const DepthFrame* depth = nullptr;
  /// Height of the floor under the person; nullopt when unknown.
  std::optional<double> floor_z_map;
};

/// Errors: of PlaceInCamera.
absl::StatusOr<PersonObservation> Observe(const HumanDetection& detection,
                                          const ObservationContext& context,
                                          const CueOptions& options);

}  // namespace dsg::ingest
