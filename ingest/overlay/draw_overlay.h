// SPDX-License-Identifier: Apache-2.0
// A camera's image with what the map has there drawn over it: rooms, objects, people with their
// trails, and what a detector said of the image.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "ingest/config/option_field.h"
#include "ingest/overlay/map_scene.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/sensor/image.h"
#include "schema/picture/raster.h"

namespace dsg::ingest {

struct OverlayOptions {
  double trail_s = 3.0;
  double reach_m = 12.0;

  std::vector<BoundOption> Bind();
};

struct OverlayImage {
  TimeNs time_ns = 0;
  Image image;
  /// Of that camera and stamp.
  std::vector<HumanDetection> detections;
};

/// Draws the room that the camera is in, objects that have not gone by then, and people that are
/// there. What the mesh hides of rooms and objects is left out, people behind it are pale; boxes of
/// detections are thin and yellow. The image keeps its size.
///
/// Requires: the image is kGray8 or kRgb8 and has the camera's size.
/// Errors: what the store returns.
absl::StatusOr<picture::Picture> DrawOverlayImage(const MapScene& scene, const Pose3d& map_T_body,
                                                  const CameraCalibration& camera,
                                                  const OverlayImage& image,
                                                  const OverlayOptions& options);

}  // namespace dsg::ingest
