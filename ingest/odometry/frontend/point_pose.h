// SPDX-License-Identifier: Apache-2.0
// Where a camera stands, from where it sees points of the world, of which many may be wrong.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/sensor/calibration.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A point of the map, metres, and the pixel at which the camera sees it.
struct PointSight {
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct PointPose {
  /// Never kNoTranslation.
  PoseOutcome outcome = PoseOutcome::kTooFewPoints;
  /// Metres; identity unless kFound.
  Pose3d map_T_camera;
  /// Position along the axes of the map, then a small turn on the right, metres and radians; 0
  /// unless kFound. As large as the misses are if these are larger than `pixel_sigma_px`; points
  /// count as exact.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Indices of sights that agree, ascending.
  std::vector<int> inliers;
  int draw_count = 0;
};

/// A pose is scored by what pixels miss it by, of which those up to `inlier_px` cost their square
/// (Geman and McClure's cost), and is the least squares of the sights that agree. `guess` is where
/// the camera is expected; it and samples of three sights are where the search begins, so that a
/// good guess needs few samples and a bad one does no harm. Sights that are not finite never agree.
///
/// Requires: `camera` has no distortion. Cost: a hundredth of a millisecond a sample.
/// Source: Ke and Roumeliotis, "An efficient algebraic solution to the perspective-three-point
/// problem", CVPR 2017 (samples); Geman and McClure, 1987.
PointPose PoseOfPoints(std::span<const PointSight> sights, const CameraCalibration& camera,
                       const Pose3d& guess, const RelativePoseOptions& options = {});

}  // namespace dsg::ingest
