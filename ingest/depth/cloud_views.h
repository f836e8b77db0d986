// SPDX-License-Identifier: Apache-2.0
// A lidar's scan as depth pictures: what cameras without distortion would see that look from the
// lidar to all six sides of a cube.
// Refuses to move points: a scan is taken to be of one instant.
#pragma once

#include <vector>

#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Pictures of the sides on which there is anything, of 90 degrees and 256 x 256 pixels, a third of
/// a degree each in the middle; of points in one pixel the nearest. Between beams up to 10 pixels
/// apart (3.5 degrees in the middle), and 3 pixels along a beam, readings are put where a plane
/// goes on: inverse depth then changes linearly. Points within 0.3 m are of the robot.
///
/// Requires: kPoints32. `map_T_lidar`: x forward, y left, z up. Order of the pictures: forward,
/// left, backward, right, up, down.
std::vector<DepthFrame> ViewsOfCloud(const Image& points, TimeNs time_ns,
                                     const Pose3d& map_T_lidar);

}  // namespace dsg::ingest
