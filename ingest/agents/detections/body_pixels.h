// SPDX-License-Identifier: Apache-2.0
// The readings of a depth picture that show a detected person.
// Refuses to say where in the body they are.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/agents/detections/floor_cue.h"
#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

struct BodyPixels {
  /// At most some thousands, from left to right in each row, rows from above.
  std::vector<Eigen::Vector3d> points_map;
  /// By the label image's own instance; else by the depth at the torso's joints.
  bool is_by_instance = false;
};

/// Empty when the picture shows nothing of the person.
/// Cost: some ten microseconds.
BodyPixels FindBodyPixels(const PlacedBody& body, const DepthFrame& depth);

}  // namespace dsg::ingest
