// SPDX-License-Identifier: Apache-2.0
// A lidar's scan as depth pictures: what cameras without distortion would see that look from the
// lidar to all six sides of a cube.
// Refuses to move points: a scan is taken to be of one instant.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Units, ranges and reasons: cloud_views.cc.
struct CloudOptions {
  double near_m = 0.3;
  double row_gap_px = 10.0;
  double column_gap_px = 3.0;
  double alike_share = 0.05;
  double slant_ratio_max = 2.0;
  double reading_count_min = 16.0;

  /// All numbers, for ValidateOptions, DigestOptions and flags.
  std::vector<BoundOption> Bind();
};

/// Pictures of the sides on which there is anything, of 90 degrees and 256 x 256 pixels, a third of
/// a degree each in the middle; of points in one pixel the nearest. Between beams that are
/// near in the picture, and along a beam, readings are put where a plane goes on: inverse depth
/// then changes linearly. Points next to the lidar are of the robot.
///
/// Requires: kPoints32. `map_T_lidar`: x forward, y left, z up. Order of the pictures: forward,
/// left, backward, right, up, down.
std::vector<DepthFrame> ViewsOfCloud(const Image& points, TimeNs time_ns, const Pose3d& map_T_lidar,
                                     const CloudOptions& options);

}  // namespace dsg::ingest
