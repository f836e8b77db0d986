// SPDX-License-Identifier: Apache-2.0
// What two keyframes of a camera have in common, and which of it moves with the world.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/odometry/frontend/stereo_pose.h"
#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

struct SeenFeature {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  std::optional<double> disparity_px;
};

/// Of one image, by the tracker's id.
using SeenFeatures = std::map<int64_t, SeenFeature>;

/// The rectified left camera, and the distance of the right one, metres.
struct StereoCamera {
  CameraCalibration left;
  double baseline_m = 0.0;
  /// There is no right one: disparities are those of measured depth.
  bool has_depth = false;
};

/// Features that both have, whose flow between both is that of no point at rest. Empty when no
/// motion explains enough of them: then nobody knows.
std::vector<int64_t> MonoOutliers(const StereoCamera& camera, const SeenFeatures& last,
                                  const SeenFeatures& now, const Eigen::Quaterniond& last_R_now,
                                  OdometryMethod method, const RelativePoseOptions& options);

struct StereoMotion {
  PoseOutcome outcome = PoseOutcome::kTooFewPoints;
  /// Of the left camera; identity unless kFound.
  Pose3d last_T_now;
  /// Of the features, those that agree with it.
  double inlier_share = 0.0;
  /// Features whose distance in both disagrees with it.
  std::vector<int64_t> outliers;
};

/// Of the features that both have with a disparity.
StereoMotion StereoMotionOf(const StereoCamera& camera, const SeenFeatures& last,
                            const SeenFeatures& now, const Eigen::Quaterniond& last_R_now,
                            OdometryMethod method, const RelativePoseOptions& options);

/// Share of the features that both have with a disparity which agree with a motion of the left
/// camera; 0 of none.
double AgreeingShare(const StereoCamera& camera, const SeenFeatures& last, const SeenFeatures& now,
                     const Pose3d& last_T_now, const RelativePoseOptions& options);

/// Median flow of the features that both have once the rotation is taken off, pixels; nullopt if
/// they have none in common.
std::optional<double> ParallaxOf(const StereoCamera& camera, const SeenFeatures& last,
                                 const SeenFeatures& now, const Eigen::Quaterniond& last_R_now);

}  // namespace dsg::ingest
