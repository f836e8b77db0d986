// SPDX-License-Identifier: Apache-2.0
// Directions that surfaces in depth images face, from planes fitted to small windows.
// Refuses windows across an edge, and windows that are not flat.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

/// Unit normals in the map that face the camera, of about `count` windows spread over the frame;
/// fewer where there is no reading or no plane.
std::vector<Eigen::Vector3d> SurfaceNormals(const DepthFrame& frame, int count);

}  // namespace dsg::ingest
