// SPDX-License-Identifier: Apache-2.0
// When an image becomes a keyframe, and what is seen in it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/odometry/frontend/feature_tracker.h"
#include "ingest/odometry/window/sliding_window.h"
#include "ingest/solver/pose_block.h"

namespace dsg::ingest {

/// Those that the tracker follows, without distances.
SeenFeatures FeaturesOf(const FeatureTracker& tracker);

/// Finds new features where there are none, and the distances of all. `now_R_depth`: how the camera
/// `left` has turned until disparities were measured, in its frame. Errors: of the tracker and of
/// OdometryFrame::disparities.
absl::StatusOr<SeenFeatures> SeeKeyframe(
    const OdometryFrame& frame, const CameraCalibration& left, FeatureTracker* tracker,
    const Eigen::Quaterniond& now_R_depth = Eigen::Quaterniond::Identity());

/// As the window takes them, ascending by id.
std::vector<FeatureSight> SightsOf(const SeenFeatures& features);

/// How many of `now` were there in `last`, too.
int64_t SharedCount(const SeenFeatures& last, const SeenFeatures& now);

/// Whether so many are gone, or have moved so far but by the rotation, that a keyframe says
/// something new.
bool HasMoved(const StereoCamera& camera, const SeenFeatures& last, const SeenFeatures& now,
              const Eigen::Quaterniond& last_R_now, const OdometryKeyframeOptions& options);

/// The covariance of another point of the same rigid body: that of `b`, from that of `a` (rows of
/// both as in the step of a pose block).
Matrix6d CovarianceAt(const Matrix6d& covariance, const Pose3d& map_T_a, const Pose3d& a_T_b);

/// FIELD_INVALID about a frame.
absl::Status BadFrame(TimeNs time_ns, const std::string& what);

}  // namespace dsg::ingest
