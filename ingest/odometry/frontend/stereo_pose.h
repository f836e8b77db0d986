// SPDX-License-Identifier: Apache-2.0
// The motion of a stereo rig between two of its pairs, from matched points with covariances, of
// which many may be wrong, and which of them are right.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/sensor/calibration.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Metres, frame of the rectified left camera.
struct StereoPoint {
  Eigen::Vector3d point;
  Eigen::Matrix3d covariance;
};

/// The same point of the world, seen by the rig at two times.
struct StereoPointPair {
  StereoPoint first;
  StereoPoint second;
};

/// Where a pixel of the rectified left camera and its disparity put a point, pixels. The baseline's
/// sign does not matter. Requires: no distortion, disparity_px > 0, baseline_m not 0.
StereoPoint StereoPointOf(const CameraCalibration& left, double baseline_m,
                          const Eigen::Vector2d& pixel, double disparity_px,
                          const RelativePoseOptions& options = {});

struct StereoPose {
  /// Never kNoTranslation: of a rig that stands still the position is 0 within its covariance.
  PoseOutcome outcome = PoseOutcome::kTooFewPoints;
  /// The second rig in the frame of the first, metres; identity unless kFound.
  Pose3d first_T_second;
  /// Of the position, axes of the first frame, m^2; 0 unless kFound. One-point: as if the rotation
  /// were exact.
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();
  /// Indices of pairs that agree, ascending.
  std::vector<int> inliers;
  int draw_count = 0;
};

/// "3pt", "1pt".
enum class StereoPoseMethod { kThreePoint, kOnePoint };
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for another name.
absl::StatusOr<StereoPoseMethod> ParseStereoPoseMethod(std::string_view name);

/// Rotation and translation from samples of three points. A motion is scored by distances in units
/// of their covariance (Geman and McClure's cost), and is the least squares of the pairs that
/// agree. Points that are not finite, or whose covariance is not positive definite, never agree;
/// three points in line are no sample. Cost: 40 samples for 50 % outliers, 194 for 70 %; each as
/// many 3x3 inversions as pairs. Source: Arun, Huang and Blostein, 1987.
StereoPose ThreePointPose(std::span<const StereoPointPair> pairs,
                          const RelativePoseOptions& options = {});

/// How many of the pairs agree with a motion, as ThreePointPose counts those of its own.
int CountAgreeing(std::span<const StereoPointPair> pairs, const Pose3d& first_T_second,
                  const RelativePoseOptions& options = {});

/// The translation alone: each pair says one, and the one that most pairs agree with wins. The
/// rotation is that of a gyroscope, unit. Without random samples: all pairs vote, or
/// `draw_count_max` evenly chosen ones.
/// Cost: votes times pairs.
StereoPose OnePointPose(std::span<const StereoPointPair> pairs,
                        const Eigen::Quaterniond& first_R_second,
                        const RelativePoseOptions& options = {});

}  // namespace dsg::ingest
