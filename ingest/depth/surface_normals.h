// SPDX-License-Identifier: Apache-2.0
// Directions that surfaces in depth images face, from planes fitted to small windows.
// Refuses windows across an edge, and windows that are not flat.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

struct NormalOptions {
  /// Edge of a window, of the image's width: 26 pixels of 640. A wider window tames noise, a
  /// narrower one finds more.
  double window_share = 0.04;
  /// Neighbours further off than this share of the distance are another surface.
  double step_share_max = 0.05;
  /// Spread along the rays over spread across them, standard deviations. The normal is about 9
  /// times as good, for so many readings along an edge of the window are fitted.
  double roughness_max = 0.5;

  std::vector<BoundOption> Bind();
};

/// Unit normals in the map that face the camera, of about `count` windows spread over the frame;
/// fewer where there is no reading or no plane.
std::vector<Eigen::Vector3d> SurfaceNormals(const DepthFrame& frame, int count,
                                            const NormalOptions& options);

}  // namespace dsg::ingest
