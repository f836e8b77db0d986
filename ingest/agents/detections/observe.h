// SPDX-License-Identifier: Apache-2.0
// From a detection, the camera's pose and what else is known to an observation in the map.
// Refuses to look at other detections.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "ingest/agents/detections/cue_options.h"
#include "ingest/agents/person_observation.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

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
