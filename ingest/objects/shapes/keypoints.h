// SPDX-License-Identifier: Apache-2.0
// Corners of a surface given as points.
// Refuses to come back empty-handed: too few corners are filled up with evenly spread points.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dsg::ingest {

struct KeypointOptions {
  double radius_m = 0.15;
  double threshold = 1e-4;
  int count_max = 60;
  /// With fewer corners, evenly spread points take their place.
  int count_min = 12;
};

/// Strongest first, at most `count_max`. The same points give the same corners.
/// Source: RSS 2020, section IV-B (Harris 3D, PCL).
std::vector<Eigen::Vector3d> FindKeypoints(const std::vector<Eigen::Vector3d>& points,
                                           const KeypointOptions& options);

}  // namespace dsg::ingest
